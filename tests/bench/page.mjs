// What a browser loads of the page, and how long it takes: from the request until the state's sentence
// stands, and until the cell is drawn. Against a real cellcald that has one session; medians.

import { existsSync } from "node:fs";
import { chromium } from "playwright-core";
import { Cell } from "./tests/page_test_cell.mjs";

const RUNS = 7;
const executablePath = process.env.CHROMIUM ?? ["/usr/bin/chromium", "/usr/bin/chromium-browser"].find(existsSync);
if (!executablePath) {
  console.log("page      no chromium here; tests/install browser installs it");
  process.exit(0);
}
const median = (values) => values.sort((a, b) => a - b)[Math.floor(values.length / 2)];

const cell = new Cell();
await cell.begin();
const browser = await chromium.launch({
  executablePath, args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
await cell.client("run", "--cell", process.env.CELL, "--touches", "12", "--check", "3");

const sentence = [], drawn = [];
let bytes = 0;
for (let i = 0; i < RUNS; ++i) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 } });
  const page = await context.newPage();
  await context.request.post(cell.url + "/v1/login", { data: { token: cell.token } });
  const begun = performance.now();
  await page.goto(cell.url, { waitUntil: "commit" });
  await page.locator(".sentence", { hasText: "Session 1" }).waitFor();
  sentence.push(performance.now() - begun);
  await page.locator(".legend").waitFor();
  await page.locator(".canvas canvas").waitFor();
  drawn.push(performance.now() - begun);
  bytes = await page.evaluate(() =>
    [...performance.getEntriesByType("navigation"), ...performance.getEntriesByType("resource")]
      .filter(({ name }) => !name.includes("/v1/")).reduce((sum, { encodedBodySize }) => sum + encodedBodySize, 0));
  await context.close();
}
await browser.close();
await cell.end();
console.log(`page      ${(bytes / 1000).toFixed(0)} kB compressed; first visit, ${RUNS} times: state after ${median(sentence).toFixed(0)} ms, cell drawn after ${median(drawn).toFixed(0)} ms`);
