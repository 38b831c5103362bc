// The page after a published calibration of the demo cell, 1100 by 880 px, as shown in the README.
//   picture.mjs FILE             creates it, as PNG
//   picture.mjs --compare FILE   fails if the page looks different now; skipped (77) without a browser

import { readFileSync } from "node:fs";
import { find_browser, launch, LONG } from "./page_browser.mjs";
import { Cell } from "./page_test_cell.mjs";

/** Means of blocks: insensitive to font smoothing, but sensitive to a line moved by half its height. */
const BLOCK_PX = 20, SAME_LEVELS = 24, LEAST_SAME = 0.97;

/** Share of blocks of two PNG files that look the same; 0: of other sizes. Runs in the browser. */
async function likeness([one, other, block, levels]) {
  const means = async (base64) => {
    const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${base64}`)).blob());
    const [columns, rows] = [Math.floor(image.width / block), Math.floor(image.height / block)];
    const canvas = new OffscreenCanvas(image.width, image.height).getContext("2d");
    canvas.drawImage(image, 0, 0);
    return Array.from({ length: columns * rows }, (_, i) => {
      const { data } = canvas.getImageData((i % columns) * block, Math.floor(i / columns) * block, block, block);
      const sum = [0, 0, 0];
      data.forEach((value, k) => { if (k % 4 < 3) sum[k % 4] += value / (block * block); });
      return sum;
    });
  };
  const [mine, others] = [await means(one), await means(other)];
  if (mine.length !== others.length) return 0;
  return mine.filter((sum, i) => sum.every((value, k) => Math.abs(value - others[i][k]) <= levels)).length / mine.length;
}

const [, , given, compared] = process.argv;
const executablePath = find_browser();
const cell = new Cell();
await cell.begin();
const browser = await launch(executablePath);
try {
  await cell.client("run", "--cell", process.env.CELL, "--touches", "64", "--check", "8");
  const context = await browser.newContext({ viewport: { width: 1100, height: 880 }, colorScheme: "light", locale: "en-GB" });
  const page = await context.newPage();
  await context.request.post(cell.url + "/v1/login", { data: { token: cell.token } });
  await page.goto(cell.url);
  await page.locator(".sentence", { hasText: "Session 1" }).waitFor(LONG);
  await page.locator(".standing[data-standing=holds]").waitFor(LONG);
  await page.locator(".canvas canvas").waitFor(LONG);
  await page.waitForTimeout(1500); // the first frames of the three-dimensional view
  const file = given === "--compare" ? "screenshots/readme.png" : given;
  await page.screenshot({ path: file });
  if (given === "--compare") {
    const blank = await context.newPage(); // the cell's page fetches only its own resources
    const files = [file, compared].map((one) => readFileSync(one, "base64"));
    const same = await blank.evaluate(likeness, [...files, BLOCK_PX, SAME_LEVELS]);
    console.log(`picture: ${(100 * same).toFixed(1)} % of ${compared} as the page is today`);
    if (same < LEAST_SAME) {
      console.error(`picture: ${compared} is stale: see screenshots/readme.png; daemon/docs/pictures makes it anew`);
      process.exitCode = 1;
    }
  }
} finally {
  await browser.close();
  await cell.end();
}
