// Pages in a browser with answers of the test: a cell on hold and its release, long names and many sessions, the keyboard, paper, a
// hung arm and a plant's collector on a telephone; in German.

import assert from "node:assert/strict";
import { build } from "esbuild";
import { readFileSync, writeFileSync } from "node:fs";
import { catalogues } from "../catalogues.mjs";
import { find_browser, launch, leave, LONG } from "./page_browser.mjs";
import { calibrated } from "./page_calibrations.mjs";

const browser = await launch(find_browser());
const { outputFiles } = await build({
  entryPoints: ["src/main.tsx", "src/abort.ts", "src/fleet/fleet.tsx", "src/style.css"], bundle: true, format: "esm", target: ["es2021"], preserveSymlinks: true,
  jsx: "automatic", jsxImportSource: "preact", outdir: "page", entryNames: "[name]", loader: { ".svg": "file" }, plugins: [catalogues], write: false, logLevel: "warning",
});
const sample = await build({ entryPoints: ["tests/kr5.ts"], format: "esm", write: false });
const { kr5 } = await import(`data:text/javascript,${encodeURIComponent(sample.outputFiles[0].text)}`);
const TYPES = { js: "text/javascript", css: "text/css" };
const FILES = Object.fromEntries(outputFiles.map(({ path, contents }) => {
  const name = path.slice(path.lastIndexOf("/") + 1);
  return [`/page/${name}`, { body: Buffer.from(contents), contentType: TYPES[name.split(".").pop()] ?? "" }];
}));
const html = (name) => ({ body: readFileSync(`src/${name}.html`, "utf8").replace(/\{\{(.*?)\}\}/g, (_, file) => `/page/${file}`), contentType: "text/html" });

/** `answer`: of a URL and its request; null: none. `begin`: run in the page before all else. */
async function open(name, viewport, answer, begin = () => {}) {
  const page = await (await browser.newContext({ locale: "de-DE", viewport })).newPage();
  await page.addInitScript(begin);
  await page.route("**/*", (route) => {
    const url = new URL(route.request().url());
    return route.fulfill(url.pathname === "/" ? html(name) : FILES[url.pathname] ?? answer(url, route.request()) ?? { status: 404, json: {} });
  });
  await page.goto("http://page.test/");
  return page;
}

async function says_that_a_cell_is_on_hold_until_it_is_released() {
  const idle = { seq: 1, phase: "idle", session: 0, running: false, arm: { motion: "unknown", packet_age_s: null } };
  let schedule = { held: "on hold", open: false, next_utc_s: null };
  const asked = new Set();
  const page = await open("index", { width: 1280, height: 800 }, ({ pathname, searchParams }) => {
    asked.add(pathname);
    const german = searchParams.get("language") === "de" && schedule.held && { ...schedule, held: "gesperrt. Zelle ansehen" };
    return pathname === "/v1/status" ? { json: { ...idle, schedule: german || schedule } } : null;
  });
  const state = page.locator("#state");
  await state.getByText("Zeitplan: gesperrt. Zelle ansehen").waitFor(LONG);
  await state.getByText("cellcal bewegt nichts. Eintreten nach den Regeln dieser Zelle.").waitFor(LONG);
  schedule = { held: null, open: true, next_utc_s: null };
  idle.seq = 2;
  await state.getByText("Draußen bleiben: Eine Sitzung kann jederzeit von selbst beginnen.").waitFor({ timeout: 5000 });
  assert.equal(await state.getByText("gesperrt").count(), 0);
  assert.ok(!asked.has("/v1/schedule"));
  await leave(page);
}

/** Answers of a daemon that is idle, with `rows` sessions of a cell whose name has no space. `more`: other answers. */
function idle_cell(rows, more = {}) {
  const cell = `/etc/cellcal/cells/${"Schweisszelle_links_hinten_".repeat(4)}.toml`;
  const step = (name) => ({ step: name, state: "todo", words: "", session: null });
  const row = (id) => ({ id, kind: "check", started: "2026-11-28T20:00:00Z", ended: "2026-11-28T20:01:00Z", state: "done", cell, touches: 8, planned: 8 });
  const answers = {
    "/v1/status": { seq: 1, phase: "idle", session: 0, running: false, arm: { motion: "unknown", packet_age_s: null }, schedule: { held: null, open: false, next_utc_s: null } },
    "/v1/me": { role: "operate", name: "test" },
    "/v1/sessions": Array.from({ length: rows }, (_, i) => row(rows - i)), "/v1/versions": [],
    "/v1/readiness": { cell, robot: "KUKA KR 16", spheres: 4, placed: 4, lengths: 0, next: "qualify", steps: ["doctor", "qualify", "calibration"].map(step) },
    "/v1/doctor": { running: false, ended: "2026-11-28T20:00:00Z", green: true, hint: "", checks: [{ check: "cell", outcome: "warning", found: cell, advice: "" }] },
    ...more,
  };
  return ({ pathname }) => answers[pathname] && { json: answers[pathname] };
}

async function keeps_long_names_and_the_focus_in_sight_on_a_telephone() {
  const page = await open("index", { width: 360, height: 640 }, idle_cell(12));
  await page.locator("table.history").waitFor(LONG);
  await page.locator("[data-doctor=done]").waitFor(LONG);
  assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), "wider than the telephone");
  assert.ok(await page.locator("table.history").evaluate((table) => table.scrollWidth <= table.parentElement.clientWidth), "results cut off");
  assert.ok(await page.locator(".guide").evaluate((guide) =>
    guide.querySelector("summary .note").getBoundingClientRect().bottom <= guide.querySelector("details > .note").getBoundingClientRect().top + 1), "lines on each other");
  const focus = () => page.evaluate(() => {
    const { activeElement: at } = document, { top, bottom } = at.getBoundingClientRect(), floor = document.getElementById("abort").getBoundingClientRect().top;
    const place = at.closest("dialog") ? "dialog" : at.closest("#abort") ? "abort" : at === document.body ? "none" : "page";
    return { place, words: at.textContent.slice(0, 20), hidden: place === "page" && bottom - top < floor && bottom > floor + 1 };
  });
  const seen = new Set();
  for (let k = 0; k < 40; ++k) {
    await page.keyboard.press("Tab");
    const { words, hidden, place } = await focus();
    assert.ok(!hidden, `the focus is below the abort bar: ${words}`);
    seen.add(place);
  }
  assert.deepEqual([...seen].sort(), ["abort", "none", "page"]);

  const start = page.getByRole("button", { name: "Sitzung starten" });
  await start.focus();
  await page.keyboard.press("Enter");
  await page.locator("dialog").waitFor(LONG);
  for (const key of ["Tab", "Shift+Tab"]) {
    const places = new Set();
    for (let k = 0; k < 25; ++k) {
      await page.keyboard.press(key);
      places.add((await focus()).place);
    }
    places.delete("none");
    assert.deepEqual([...places].sort(), ["abort", "dialog"], `the focus left the dialog by ${key}`);
  }
  await page.keyboard.press("Escape");
  await page.locator("dialog").waitFor({ ...LONG, state: "detached" });
  assert.ok(await start.evaluate((one) => document.activeElement === one), "the focus is not where it was");

  await page.emulateMedia({ media: "print", colorScheme: "dark" });
  assert.equal(await page.locator("#abort").isVisible(), false);
  assert.equal(await page.evaluate(() => getComputedStyle(document.documentElement).getPropertyValue("--ink")), "#16202b", "dark on paper");
  await leave(page);
}

const gone = (place) => place.waitFor({ ...LONG, state: "detached" });

async function closes_the_start_of_a_session_for_good_when_another_one_begins() {
  const status = { seq: 1, phase: "idle", session: 0, running: false, arm: { motion: "unknown", packet_age_s: null } };
  const { drift, versions } = calibrated({});
  const page = await open("index", { width: 1280, height: 800 }, idle_cell(1, { "/v1/status": status, "/v1/drift": { sessions: [], checks: drift }, "/v1/versions": versions }));
  const dialog = page.locator("dialog"), line = page.locator(".standing");
  for (const by of [page.locator(".begin").getByRole("button", { name: "Sitzung starten" }), line.getByRole("button", { name: "Jetzt prüfen" })]) {
    await by.click(LONG);
    await dialog.locator("select[name=kind]").selectOption("check");
    Object.assign(status, { seq: status.seq + 1, session: status.session + 1, phase: "planning", running: true });
    await page.locator('.standing[data-small="true"]').waitFor(LONG);
    await gone(dialog);
    Object.assign(status, { seq: status.seq + 1, phase: "idle", running: false });
    await page.locator('.standing[data-small="false"]').waitFor(LONG);
    await by.waitFor(LONG);
    assert.equal(await dialog.count(), 0, "opened by itself");
  }
  await leave(page);
}

async function keeps_the_form_of_the_cell_while_nobody_is_signed_in_and_asks_before_it_is_dropped() {
  const status = { seq: 1, phase: "idle", session: 0, running: false, arm: { motion: "unknown", packet_age_s: null } };
  const form = { folder: "/s/cells", reads_position: false, robots: [{ name: "kr5_r1400", model: "KUKA KR 5" }], shown: null };
  const idle = idle_cell(0, { "/v1/status": status, "/v1/cell-form": form });
  let signed_in = true;
  const page = await open("index", { width: 1280, height: 800 }, (url, request) => {
    if (url.pathname === "/v1/login") signed_in = request.postDataJSON().token === "right";
    const refused = !signed_in || (request.method() === "POST" && url.pathname === "/v1/cell-form");
    return refused ? { status: signed_in ? 422 : 401, json: { error: "a token is needed" } } : url.pathname === "/v1/login" ? { json: {} } : idle(url);
  });
  await page.getByRole("button", { name: "Zelle hier eingeben oder ändern" }).click(LONG);
  const dialog = page.locator("dialog"), xyz = dialog.getByLabel("TCP: X Y Z"), write = dialog.getByRole("button", { name: "Schreiben" });
  await dialog.locator("[name=cell-robot]").selectOption("kr5_r1400");
  await xyz.fill("59,9 50,5 410,3");
  await dialog.getByLabel("TCP bekannt auf").fill("1");
  for (const row of await dialog.locator("[data-sphere]").all()) {
    await row.getByLabel("Durchmesser").fill("50");
    await row.getByLabel("U (k = 2)").fill("0,002");
    await row.getByLabel("X Y Z des Mittelpunkts").fill("900 0 400");
  }
  signed_in = false;
  await write.click();
  const sign_in = page.getByLabel("Token");
  await sign_in.waitFor(LONG);
  await write.click();
  await dialog.getByText("Abgemeldet. Anmelden, dann noch einmal versuchen.").waitFor(LONG);
  assert.equal(await page.getByText("a token is needed").count(), 0, "English in a German page");
  await page.screenshot({ path: "screenshots/signed-out-form.png" });
  assert.ok(await sign_in.evaluate((field) => {
    const { left, top, width, height } = field.getBoundingClientRect();
    return document.elementFromPoint(left + width / 2, top + height / 2) === field;
  }), "the sign-in is out of reach");
  await sign_in.fill("right");
  await page.keyboard.press("Enter");
  await gone(sign_in);
  await gone(dialog.getByText("Abgemeldet."));
  assert.equal(await xyz.inputValue(), "59,9 50,5 410,3");

  const question = dialog.getByText("Verwerfen löscht die Eingaben."), reached = () => page.evaluate(() => document.activeElement.textContent);
  await page.keyboard.press("Escape");
  await question.waitFor(LONG);
  assert.equal(await reached(), "Behalten");
  await page.screenshot({ path: "screenshots/discard-form.png" });
  await page.keyboard.press("Escape");
  await gone(question);
  await dialog.getByRole("button", { name: "Zurück", exact: true }).click();
  await dialog.getByRole("button", { name: "Behalten" }).click();
  assert.equal(await xyz.inputValue(), "59,9 50,5 410,3");
  await page.keyboard.press("Escape");
  await dialog.getByRole("button", { name: "Verwerfen" }).click();
  await gone(dialog);
  await page.getByRole("button", { name: "Zelle hier eingeben oder ändern" }).click();
  await dialog.getByLabel("Name der Datei").waitFor(LONG);
  await page.keyboard.press("Escape");
  await gone(dialog); // nothing was entered
  await leave(page);
}

async function marks_the_doctors_findings_of_an_earlier_cell_file() {
  const file = "/c/demo.toml";
  for (const state of ["todo", "done"]) {
    const page = await open("index", { width: 1280, height: 800 }, idle_cell(0, {
      "/v1/doctor": { cell: file, running: false, ended: "2026-11-28T20:00:00Z", green: true, hint: "", checks: [] },
      "/v1/readiness": { cell: file, robot: "", spheres: 0, placed: 0, lengths: 0, next: state === "todo" ? "doctor" : null, steps: [{ step: "doctor", state, words: "", session: null }] } }));
    const panel = page.locator("[data-doctor]");
    await panel.getByText("nichts fehlgeschlagen").waitFor(LONG);
    assert.equal(await panel.getByText("Von einem früheren Stand der Zellen- oder Roboterdatei").count(), state === "todo" ? 1 : 0);
    await leave(page);
  }
}

async function has_the_daemons_sentences_in_its_language_and_marks_those_in_english() {
  const status = (more) => ({ seq: 1, phase: "connecting", session: 2, running: true, touches: 0, planned: 8, arm: { motion: "unknown", packet_age_s: null }, ...more });
  const waiting = (start) => status({ waiting: { robot: true, contact: false, left_s: 80, start } });
  const missing = "/dev/contact2: no such device. Plug the sensor in";
  const failed = (then) => status({ seq: 2, phase: "failed", running: false, failure: { kind: "device", detail: `${missing}. ${then}: 'cellcal run --resume'` } });
  let now = waiting("start CELLCAL_RSI on the pendant"), german = waiting("CELLCAL_RSI am Bediengerät starten");
  const page = await open("index", { width: 1280, height: 800 }, ({ pathname, searchParams }) =>
    pathname === "/v1/status" ? { json: searchParams.get("language") === "de" ? german : now } : null);
  const start = page.locator(".waiting span");
  await start.getByText("CELLCAL_RSI am Bediengerät starten").waitFor(LONG);
  assert.equal(await start.getAttribute("lang"), "de");
  [now, german] = ["Then", "Danach"].map(failed);
  const evidence = page.locator(".evidence span");
  await evidence.getByText(missing).waitFor(LONG);
  assert.equal(await evidence.innerText(), `${missing}. Then: 'cellcal run --resume'`);
  assert.equal(await evidence.getAttribute("lang"), "en");
  await leave(page);
}

async function names_the_cell_file_of_the_doctors_findings_where_it_is_not_the_one_shown() {
  const of = (cell) => ({ cell, running: false, ended: "2026-11-28T20:00:00Z", green: true, hint: "", checks: [] });
  const examined = [];
  for (const [file, other] of [["/c/weld-2.toml", true], ["/c/demo.toml", false]]) {
    const idle = idle_cell(0, { "/v1/doctor": of(file), "/v1/sessions": [{ id: 1, kind: "check", started: "", ended: "", state: "done", cell: "/c/demo.toml", touches: 8, planned: 8 }],
                                "/v1/readiness": { cell: "", robot: "", spheres: 0, placed: 0, lengths: 0, next: null, steps: [] } });
    const page = await open("index", { width: 1280, height: 800 }, (url, request) => {
      if (request.method() === "POST" && url.pathname === "/v1/doctor") examined.push(request.postDataJSON().cell);
      return idle(url);
    });
    const panel = page.locator("[data-doctor]");
    await panel.getByText(file).waitFor(LONG);
    assert.equal(await panel.getByText("Nicht von der Zelle, die diese Seite zeigt (demo).").count(), other ? 1 : 0);
    await panel.screenshot({ path: `screenshots/doctor-${other ? "other" : "same"}.png` });
    await panel.getByRole("button", { name: other ? "Diagnose für demo starten" : "Diagnose starten", exact: true }).click();
    for (let k = 0; k < 50 && examined.length === 0; ++k) await page.waitForTimeout(100);
    assert.deepEqual(examined.splice(0), ["/c/demo.toml"]);
    await leave(page);
  }
}

/** The drawn cell of `scene`, as PNG. */
async function drawn(scene) {
  const idle = { seq: 1, phase: "idle", session: 3, running: false, arm: { motion: "unknown", packet_age_s: null } };
  const answers = { "/v1/status": idle, "/v1/me": { role: "operate", name: "test" }, "/v1/scene": scene,
                    "/v1/sessions/3/plan": { session: 3, touches: [{ index: 0, target: scene.targets[0].id, set: "fit", joints_deg: [0, -90, 90, 0, 0, 0], way_deg: [], tip_mm: scene.targets[0].centre_mm }] } };
  const page = await open("index", { width: 1280, height: 1600 }, ({ pathname }) => answers[pathname] && { json: answers[pathname] });
  await page.locator("ul.legend").waitFor(LONG);
  await page.waitForTimeout(1000); // the first frames
  const png = await page.locator(".canvas canvas").screenshot();
  await leave(page);
  return png;
}

const half_turn = ([x, y, z]) => [x, -y, -z];

async function draws_a_hung_arm_on_the_floor_of_its_cell() {
  const [scene, targets] = [kr5(), [[900, -320, 330], [700, 400, 600]]];
  const place = (turn) => ({ ...scene, up: turn([0, 0, 1]), floor_mm: -200, targets: targets.map((one, i) => ({ ...scene.targets[0], id: `S${i}`, centre_mm: turn(one) })) });
  const upright = await drawn(place((one) => one));
  // An upright arm whose base frame is upside down.
  const hung = await drawn({ ...place(half_turn), base: [1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0] });
  writeFileSync("screenshots/upright.png", upright);
  writeFileSync("screenshots/hung.png", hung);
  assert.ok(upright.equals(hung), "not the same: screenshots/upright.png, hung.png");
}

async function names_the_spheres_distinguishably() {
  const named = (id) => drawn({ ...kr5(), targets: [{ ...kr5().targets[0], id }] });
  for (const name of ["Kugel", "Eine sehr lange Bezeichnung der Kugel"])
    assert.ok(!(await named(`${name} 1`)).equals(await named(`${name} 2`)), `${name} 1 as ${name} 2`);
}

async function writes_thousands_of_sessions_only_once() {
  const page = await open("index", { width: 1280, height: 800 }, idle_cell(2000));
  await page.getByRole("button", { name: "Alle 2000 zeigen" }).click(LONG);
  await page.locator("table.history tbody tr").nth(1999).waitFor(LONG);
  const written = await page.evaluate(async () => {
    let times = 0;
    const { getTime } = Date.prototype;
    Date.prototype.getTime = function () { ++times; return getTime.call(this); };
    await new Promise((done) => setTimeout(done, 2500));
    return times;
  });
  assert.ok(written < 2000, `${written} times written in 2.5 s without news`);
  await leave(page);
}

async function is_shown_in_a_browser_without_a_locale() {
  const page = await open("index", { width: 1024, height: 600 }, idle_cell(1), () => Object.defineProperty(Navigator.prototype, "language", { get: () => "C" }));
  await page.getByRole("button", { name: "Start a session" }).waitFor(LONG);
  await leave(page);
}

async function shows_a_plant_in_german_on_a_telephone() {
  const TIME = "2026-11-28T20:00:00Z";
  const needs = [{ what: "check-not-held", since: TIME, detail: "tool" }, { what: "withheld", since: TIME, detail: "check_touches, no_gain" },
                 { what: "drifted", since: TIME, detail: "Session 4: the cell has changed" }, { what: "overdue", since: TIME, detail: "calibration" }];
  const state = { plant: "graz", cell: "weld-3", since: TIME, online: true, robot: "KR 16 R2010-2 of the second line, with a linear unit", held: "no" };
  const session = (number, of, more = {}) => ({ journal: "j", session: number, at: TIME, state: of, purpose: "calibrate", touches: 60, planned: 60, failure_kind: "", failure: "", ...more });
  const answers = {
    "/v1/fleet/cells": { cells: [{ ...state, needs }] },
    "/v1/fleet/cells/graz/weld-3": { state, needs, calibrations: [], checks: [], gaps: [], refused: [{ why: "size", count: 2, newest: TIME }],
      sessions: [session(4, "failed", { failure_kind: "no-contact", failure: "no-contact: S1" }), session(3, "done"), session(2, "running")] },
    "/v1/fleet/compare": { robot: state.robot, joint: "A1", corrections: [] },
  };
  const page = await open("fleet", { width: 390, height: 844 }, ({ pathname }) => answers[pathname] && { json: answers[pathname] });
  await page.getByRole("button", { name: "graz/weld-3" }).click();
  const cell = page.locator("section", { has: page.locator("#cell-title") });
  await cell.getByText("fertig").waitFor(LONG);
  const words = (await cell.innerText()).replace(/no-contact: S1/, "");
  for (const told of ["Kontrollantastungen, zu geringer Gewinn", "wahrscheinlich das Werkzeug", "fehlgeschlagen", "Kein Kontakt bis zum Ende der Suche", "zu groß"])
    assert.ok(words.includes(told), `${told}: ${words}`);
  for (const raw of ["check_touches", "done", "running", "changed", "failed", ": tool", "calibration", "(size)"])
    assert.ok(!words.includes(raw), `${raw}: ${words}`);
  const beyond = await page.locator("main select").evaluateAll((all) =>
    all.filter((one) => one.getBoundingClientRect().right > one.closest("section").getBoundingClientRect().right).map(({ name }) => name));
  assert.deepEqual(beyond, [], "boxes past their card");
  await leave(page);
}

try {
  for (const step of [says_that_a_cell_is_on_hold_until_it_is_released, keeps_long_names_and_the_focus_in_sight_on_a_telephone,
                      closes_the_start_of_a_session_for_good_when_another_one_begins, keeps_the_form_of_the_cell_while_nobody_is_signed_in_and_asks_before_it_is_dropped,
                      names_the_cell_file_of_the_doctors_findings_where_it_is_not_the_one_shown,
                      marks_the_doctors_findings_of_an_earlier_cell_file, has_the_daemons_sentences_in_its_language_and_marks_those_in_english,
                      draws_a_hung_arm_on_the_floor_of_its_cell, names_the_spheres_distinguishably, writes_thousands_of_sessions_only_once,
                      is_shown_in_a_browser_without_a_locale, shows_a_plant_in_german_on_a_telephone]) {
    await step();
    console.log(`ok      the page ${step.name.replaceAll("_", " ")}`);
  }
} finally {
  await browser.close();
}
