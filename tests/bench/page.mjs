// First visits of the page, as Lighthouse describes them: a real cellcald on the emulated cell, headless Chromium that
// renders in software, without network throttling. LOADS in the environment: visits per kind (5).

import { existsSync } from "node:fs";
import { chromium } from "playwright-core";
import { Cell } from "./tests/page_test_cell.mjs";

const LOADS = Number(process.env.LOADS ?? 5);
const VIEWS = [[390, 844], [1280, 800]], SLOWDOWNS = [1, 4];
/** Minimum duration of a long task of the main thread [ms]. */
const LONG_TASK_MS = 50;
/** The page is at rest after this time without a long task [ms]; on a busy computer it may never be. */
const REST_MS = 1500, LONGEST_MS = 20_000;

const executablePath = process.env.CHROMIUM ?? ["/usr/bin/chromium", "/usr/bin/chromium-browser"].find(existsSync);
if (!executablePath) {
  console.log("page      no chromium here; tests/install browser installs it");
  process.exit(0);
}

/** Runs in the page from its first byte on. `clicks`: clicks the start button as soon as it is there. */
function watch(clicks) {
  const seen = { first_paint: NaN, largest_paint: NaN, shift: 0, tasks: [], sentence: NaN, drawn: NaN, answered: NaN };
  globalThis.bench = seen;
  const follow = (type, take) =>
    new PerformanceObserver((list) => list.getEntries().forEach(take)).observe({ type, buffered: true });
  follow("paint", (one) => { if (one.name === "first-contentful-paint") seen.first_paint = one.startTime; });
  follow("largest-contentful-paint", (one) => { seen.largest_paint = one.startTime; });
  follow("layout-shift", (one) => { seen.shift += one.value; });
  follow("longtask", (one) => { seen.tasks.push([one.startTime, one.duration]); });
  const first = (name, found) => { if (Number.isNaN(seen[name]) && found) seen[name] = performance.now(); };
  let clicked = false;
  const look = () => {
    first("sentence", document.querySelector("p.sentence")?.textContent.includes("1"));
    first("drawn", document.querySelector(".canvas canvas") && document.querySelector(".legend"));
    if (clicks) first("answered", document.querySelector("dialog[open]"));
    const button = clicks && !clicked && [...document.querySelectorAll("main button")].find((one) => one.textContent === "Start a session");
    if (button) { clicked = true; button.click(); }
    requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
}

/** Bytes on the wire, headers included, by kind of resource. */
async function count(traffic, devtools) {
  const kinds = new Map();
  const add = (kind, bytes) => { traffic.bytes += bytes; if (kind === "Script") traffic.script += bytes; };
  devtools.on("Network.requestWillBeSent", () => { ++traffic.requests; });
  devtools.on("Network.responseReceived", ({ requestId, type, response }) => {
    kinds.set(requestId, type);
    add(type, response.encodedDataLength);
  });
  devtools.on("Network.dataReceived", ({ requestId, encodedDataLength }) => add(kinds.get(requestId), encodedDataLength));
  await devtools.send("Network.enable");
}

async function visit(browser, cell, [width, height], slowdown, clicks) {
  const context = await browser.newContext({ viewport: { width, height }, locale: "en-GB" });
  await context.request.post(cell.url + "/v1/login", { data: { token: cell.token } });
  const page = await context.newPage();
  const devtools = await context.newCDPSession(page), traffic = { bytes: 0, script: 0, requests: 0 };
  await count(traffic, devtools);
  await devtools.send("Emulation.setCPUThrottlingRate", { rate: slowdown });
  await page.addInitScript(watch, clicks);
  await page.goto(cell.url, { waitUntil: "commit" });
  await page.waitForFunction(([clicking, rest, longest]) => {
    const { sentence, drawn, answered, tasks } = globalThis.bench;
    const [start, duration] = tasks.at(-1) ?? [0, 0];
    const complete = Math.max(sentence, drawn, clicking ? answered : 0);
    return performance.now() > Math.min(Math.max(complete, start + duration) + rest, complete + longest);
  }, [clicks, REST_MS, LONGEST_MS], { timeout: 120_000 });
  const seen = await page.evaluate(() => globalThis.bench);
  await context.close();
  const late = seen.tasks.filter(([start]) => start >= seen.first_paint);
  return {
    ...traffic, ...seen, kB: traffic.bytes / 1000, script_kB: traffic.script / 1000,
    blocked: late.reduce((sum, [, duration]) => sum + duration - LONG_TASK_MS, 0),
    interactive: Math.max(seen.first_paint, ...late.map(([start, duration]) => start + duration)),
  };
}

const FIGURES = {
  kB: ["transferred, kB", 0], requests: ["requests", 0], script_kB: ["scripts of that, kB", 0],
  first_paint: ["first contentful paint, ms", 0], largest_paint: ["largest contentful paint, ms", 0],
  sentence: ["state's sentence stands, ms", 0], drawn: ["cell drawn, ms", 0],
  interactive: ["end of the last long task, ms", 0], blocked: ["total blocking time, ms", 0],
  shift: ["cumulative layout shift", 3],
};

function print(name, values, digits) {
  const sorted = [...values].sort((a, b) => a - b);
  const median = sorted[Math.floor(sorted.length / 2)];
  console.log(`  ${name.padEnd(40)} ${median.toFixed(digits).padStart(8)} ${sorted.at(-1).toFixed(digits).padStart(8)}`);
}

const cell = new Cell();
await cell.begin();
const browser = await chromium.launch({
  executablePath, args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
try {
  await cell.client("run", "--cell", process.env.CELL, "--touches", "12", "--check", "3");
  for (const slowdown of SLOWDOWNS)
    for (const view of VIEWS) {
      const visits = [], clicked = [];
      for (let i = 0; i < LOADS; ++i) {
        visits.push(await visit(browser, cell, view, slowdown, false));
        clicked.push(await visit(browser, cell, view, slowdown, true));
      }
      console.log(`page      ${view.join(" x ")}, processor ${slowdown === 1 ? "as it is" : `${slowdown} times slower`}, ${LOADS} first visits: median, worst`);
      for (const [key, [name, digits]] of Object.entries(FIGURES)) print(name, visits.map((one) => one[key]), digits);
      print("first click answered by its dialog, ms", clicked.map((one) => one.answered), 0);
    }
} finally {
  await browser.close();
  await cell.end();
}
