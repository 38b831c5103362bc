// picture.mjs FILE: the page after a published calibration of the demo cell, 1100 by 880 px, as PNG.

import { existsSync } from "node:fs";
import { chromium } from "playwright-core";
import { Cell } from "./page_test_cell.mjs";

const executablePath = process.env.CHROMIUM ?? ["/usr/bin/chromium", "/usr/bin/chromium-browser"].find(existsSync);
if (!executablePath) {
  console.error("picture: no chromium; 'tests/install browser' installs it");
  process.exit(1);
}
const cell = new Cell();
await cell.begin();
const browser = await chromium.launch({
  executablePath, args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
try {
  await cell.client("run", "--cell", process.env.CELL, "--touches", "64", "--check", "8");
  const context = await browser.newContext({ viewport: { width: 1100, height: 880 }, colorScheme: "light", locale: "en-GB" });
  const page = await context.newPage();
  await context.request.post(cell.url + "/v1/login", { data: { token: cell.token } });
  await page.goto(cell.url);
  await page.locator(".sentence", { hasText: "Session 1" }).waitFor({ timeout: 60_000 });
  await page.locator(".canvas canvas").waitFor({ timeout: 60_000 });
  await page.waitForTimeout(1500); // the first frames of the three-dimensional view
  await page.screenshot({ path: process.argv[2] });
} finally {
  await browser.close();
  await cell.end();
}
