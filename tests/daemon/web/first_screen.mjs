// The page's first screen: eight questions, answered in every language of the catalogue; and pictures of a state.

import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { accessible, is_in_reach, LONG } from "./page_browser.mjs";

const flat = (text) => text.replace(/\s+/g, " ");
const escaped = (text) => flat(text).replace(/[.*+?^${}()|[\]\\]/g, "\\$&");
/** Catalogues of the page: { en: { "phase.idle": ... }, de: ... } */
const WORDS = Object.fromEntries(readdirSync("src/words").filter((file) => file.endsWith(".json"))
  .map((file) => [file.slice(0, -".json".length), JSON.parse(readFileSync(`src/words/${file}`, "utf8"))]));
assert.ok(Object.keys(WORDS).length >= 2);

// Expected text, in any language: a key of the catalogue, a RegExp, or a function of a catalogue.
const source = (wanted, words) =>
  typeof wanted === "function" ? wanted(words) : wanted instanceof RegExp ? wanted.source : said(wanted)(words);
/** A sentence with these values; values not given are arbitrary. */
export const said = (key, values = {}) => (words) => {
  assert.ok(key in words, `no sentence ${key}`);
  return words[key].split(/(\{\w+\})/)
    .map((part, i) => (i % 2 === 0 ? escaped(part) : source(values[part.slice(1, -1)] ?? /.*?/, words))).join("");
};
export const seq = (...parts) => (words) => parts.map((one) => source(one, words)).join(".*");
export const any = (...parts) => (words) => `(?:${parts.map((one) => source(one, words)).join("|")})`;

/** Text of the first screen: within the window and above the abort bar. */
export const first_screen = (page) => page.evaluate(() => {
  const floor = document.getElementById("abort").getBoundingClientRect().top;
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const seen = [];
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const parent = node.parentElement;
    if (node.textContent.trim() === "" || !parent.checkVisibility() || parent.closest(".unseen, .skip, dialog, [aria-hidden=true]")) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    const { top, bottom, left, right } = range.getBoundingClientRect();
    if (top >= 0 && bottom <= floor && left >= 0 && right <= innerWidth) seen.push(node.textContent);
  }
  return seen.join(" ").replace(/\s+/g, " ");
});

const QUESTIONS = ["calibrated", "good", "since", "doing", "long", "wrong", "todo", "near"];

async function in_each_language(page, languages, act) {
  const shown = await page.evaluate(() => document.documentElement.lang);
  for (const language of [...languages.filter((one) => one !== shown), shown]) {
    await page.locator('[name="language"]').selectOption(language);
    await page.waitForFunction((wanted) => document.documentElement.lang === wanted, language, LONG);
    await act(language);
  }
}

/** The eight questions are answered at 1280 x 800 without scrolling, in every language. */
export async function answers(page, state, expected) {
  assert.deepEqual(Object.keys(expected).sort(), [...QUESTIONS].sort());
  await page.setViewportSize({ width: 1280, height: 800 });
  await page.evaluate(() => scrollTo(0, 0));
  await in_each_language(page, Object.keys(WORDS), async (language) => {
    const all = Object.entries({ names: /^demo KUKA KR 5/, ...expected })
      .map(([question, wanted]) => [question, new RegExp(source(wanted, WORDS[language]))]);
    const lacking = (text) => all.filter(([, wanted]) => !wanted.test(text)).map(([question]) => question);
    let text = await first_screen(page);
    for (let k = 0; k < 100 && lacking(text).length > 0; ++k) {
      await page.waitForTimeout(100);
      text = await first_screen(page);
    }
    assert.deepEqual(lacking(text), [], `${state}, ${language}: not answered by the first screen, which reads: ${text}`);
    assert.match(await page.title(), /^demo, KUKA KR 5.* · ./, state);
  });
}

export const VIEWS = [[1280, 800, "light"], [390, 844, "dark"], [1920, 1080, "dark"], [1280, 800, "dark"], [390, 844, "light"], [1920, 1080, "light"]];

/** All sizes, colours and languages, for inspection; otherwise the first `views` of VIEWS in the language shown. */
const EVERY = process.env.PICTURES === "all";

export async function picture(name, page) {
  await page.screenshot({ path: `screenshots/${name}.png` });
}

/** Pictures of the state, on which nothing is too wide, the abort button is in reach and axe-core finds nothing serious. */
export async function pictures(page, state, views = 2) {
  const shown = await page.evaluate(() => document.documentElement.lang);
  await in_each_language(page, EVERY ? Object.keys(WORDS) : [shown], async (language) => {
    for (const [width, height, colorScheme] of VIEWS.slice(0, EVERY ? VIEWS.length : views)) {
      await page.emulateMedia({ colorScheme });
      await page.setViewportSize({ width, height });
      await page.waitForFunction((theme) => document.documentElement.dataset.theme === theme, colorScheme, LONG);
      await page.waitForFunction(() => document.documentElement.scrollWidth <= innerWidth, null, { timeout: 5000 })
        .catch(() => assert.fail(`${state}: the page is wider than ${width} px`));
      assert.ok(await is_in_reach(page), `${state}: abort is covered at ${width}`);
      await accessible(page, `${state}, ${width} px, ${colorScheme}`);
      await picture(`state-${state}-${width}-${colorScheme}${EVERY ? `-${language}` : ""}`, page);
    }
  });
  await page.emulateMedia({ colorScheme: "light" });
  await page.setViewportSize({ width: 1280, height: 800 });
}

/** Large: three times the smallest height of a target. */
export const abort_is = (page, size) => page.waitForFunction((large) => {
  const { height } = document.getElementById("abort-button").getBoundingClientRect();
  return large ? height >= 60 : height >= 44 && height < 60;
}, size === "large", LONG);
