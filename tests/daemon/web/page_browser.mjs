// The browser that the page's tests share.

import assert from "node:assert/strict";
import { existsSync, mkdirSync, readFileSync } from "node:fs";
import { chromium } from "playwright-core";

export const LONG = { timeout: 60_000 };
const PLACES = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];

/** Ends the test as skipped if there is none. */
export function find_browser() {
  const found = process.env.CHROMIUM ?? PLACES.find(existsSync);
  if (found) return found;
  console.log("page: skipped, no chromium here; tests/install browser installs it");
  process.exit(77);
}

export function launch(executablePath) {
  mkdirSync("screenshots", { recursive: true });
  return chromium.launch({ executablePath, args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"] });
}

/** Closes a page whose requests are answered by the test: one may be in transit. */
export async function leave(page) {
  await page.unrouteAll({ behavior: "ignoreErrors" });
  await page.context().close();
}

/** Waits for the state's sentence. */
export const sees = (page, words) =>
  page.waitForFunction((source) => new RegExp(source).test(document.querySelector(".sentence")?.textContent ?? ""), words.source, LONG);

/** True if a click on the centre of the abort button reaches it. */
export const is_in_reach = (page) =>
  page.evaluate(() => {
    const { left, top, width, height } = document.getElementById("abort-button").getBoundingClientRect();
    return document.elementFromPoint(left + width / 2, top + height / 2)?.id === "abort-button";
  });

const AXE = readFileSync("node_modules/axe-core/axe.min.js", "utf8");

/** No serious or critical finding of axe-core. */
export async function accessible(page, state) {
  await page.evaluate(AXE);
  const found = await page.evaluate(async () => {
    const { violations } = await axe.run(document, { resultTypes: ["violations"] });
    return violations.filter(({ impact }) => impact === "serious" || impact === "critical")
      .map(({ id, nodes }) => `${id}: ${nodes.map(({ html, failureSummary }) => `${html.slice(0, 160)} ${failureSummary}`).slice(0, 4).join("; ")}`);
  });
  assert.deepEqual(found, [], `${state}: findings of axe-core`);
}

/** Runs the steps in order until one fails. True: all succeeded. */
export async function say_steps(steps, { cell, browser, wrong = [] }) {
  const shared = {};
  try {
    for (const [name, step] of Object.entries(steps)) {
      const begun = performance.now();
      try {
        await step.call(shared);
        assert.deepEqual(wrong, [], "errors in the browser");
        console.log(`ok      the page ${name} (${((performance.now() - begun) / 1000).toFixed(1)} s)`);
      } catch (error) {
        console.log(`FAILED  the page ${name}\n${error.stack}`);
        await shared.page?.screenshot({ path: "screenshots/failed.png" });
        return false;
      }
    }
    return true;
  } finally {
    await browser.close();
    await cell.end();
  }
}
