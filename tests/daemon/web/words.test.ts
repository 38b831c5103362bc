import assert from "node:assert/strict";
import { readFileSync, readdirSync, realpathSync } from "node:fs";
import { test } from "node:test";
import { formats } from "../src/format";
import { run_request, WHOLE } from "../src/ui/start";
import * as api from "../generated/api";
import { command_of } from "../src/ui/guide";
import { tick_words } from "../src/ui/chart";
import { language_of } from "../src/ui/context";
import { published, zero_changes } from "../src/ui/drift";
import { CATALOGUES, speaker, type Key } from "../src/words";
import { words_of } from "./kr5";

const ADVICE = words_of(api.Advice), CHANGES = words_of(api.ChangeKind).filter((one) => (one as string) !== "nothing");
const CHECKS = words_of(api.Check), DRIFT_STATES = words_of(api.DriftState), NOT_AS_STATED = words_of(api.NotAsStated);
const OUTCOMES = words_of(api.OutcomeKind), PHASES = words_of(api.Phase), FAILURES = words_of(api.FailureKind);
const STEPS = words_of(api.Step) as Exclude<api.Step, "unknown">[];

/** Names of an enum's enumerators, as calib/model/enum_table.h makes them. */
const own_names = (file: string, type: string, between = "_") => {
  const source = readFileSync(`${realpathSync("src")}/../../../${file}`, "utf8");
  const body = source.split(new RegExp(`enum class ${type}\\b`))[1]?.split("};")[0]?.split("{")[1] ?? "";
  return [...body.replace(/\/\/.*/g, "").matchAll(/\bk([A-Z]\w*)/g)]
    .map((match) => (match[1] ?? "").replace(/(?!^)[A-Z]/g, `${between}$&`).toLowerCase());
};

const { en } = CATALOGUES, de = CATALOGUES.de!;
const places = (words: string) => (words.match(/\{\w+\}/g) ?? []).sort();

test("every language says the same things with the same values", () => {
  assert.ok(Object.keys(CATALOGUES).length > 1);
  for (const other of Object.values(CATALOGUES)) {
    assert.deepEqual(Object.keys(other).sort(), Object.keys(en).sort());
    for (const key of Object.keys(en) as Key[]) {
      assert.ok(other[key].trim() !== "", key);
      assert.deepEqual(places(other[key]), places(en[key]), key);
    }
  }
});

test("the page is without the sentences of programs", () => {
  assert.deepEqual(Object.keys(en).filter((key) => key.startsWith("say.")), []);
});

test("no words are kept that nobody says", () => {
  const files = (readdirSync("src", { recursive: true } as never) as unknown as string[])
    .filter((file) => /\.tsx?$/.test(file) && !file.startsWith("words/"));
  const source = files.map((file) => readFileSync(`src/${file}`, "utf8")).join("\n");
  const said = (key: string) => source.includes(`"${key}"`) ||
    [...key].some((letter, i) => letter === "." && source.includes("`" + key.slice(0, i + 1) + "${"));
  assert.ok(files.length > 10);
  assert.deepEqual(Object.keys(en).filter((key) => !said(key.replace(/\.one$/, ""))), []);
});

test("the page has words for every phase and every failure that the daemon has", () => {
  const phases = own_names("daemon/session/phase.h", "Phase", " ");
  assert.ok(phases.length > 20);
  assert.deepEqual([...PHASES].sort(), phases.sort());
  assert.deepEqual([...FAILURES].sort(), own_names("daemon/session/failure.h", "FailureKind", "-").sort());
});

test("the page has a name for everything that the doctor looks at", () => {
  const folder = `${realpathSync("src")}/../../doctor`;
  const source = readdirSync(folder).filter((file) => file.endsWith(".cc"))
    .map((file) => readFileSync(`${folder}/${file}`, "utf8")).join("\n");
  const named = [...source.matchAll(/(?:findings_?\.(?:ok|warn|fail|skip)\(|judge_(?:link|angles)\(|check = )\s*"([^"]+)"/g)].map((match) => match[1]);
  assert.ok(new Set(named).size > 30);
  assert.deepEqual([...new Set(named)].filter((name) => !CHECKS.some((one) => one === name)), []);
  assert.deepEqual(CHECKS.filter((one) => one !== "doctor" && !source.includes(`"${one}"`)), []);
});

test("the guide has every step of the daemon, and a command for each that names the cell", () => {
  assert.deepEqual(own_names("daemon/doctor/steps.h", "SetUpStep", "-"), [...STEPS]);
  for (const step of STEPS) assert.match(command_of(step, "/c/cell.toml"), /^cellcal [a-z-]+ .*\/c\/cell\.toml/);
  assert.equal(command_of("cell", ""), "sudo cellcal new-cell -o /etc/cellcal/cell.toml");
  assert.equal(command_of("doctor", "/my cells/o'neil.toml"), "cellcal doctor --cell '/my cells/o'\\''neil.toml'");
});

test("only names and the field's own words are the same in both", () => {
  const same = (Object.keys(en) as Key[]).filter((key) => en[key] === de[key]);
  assert.deepEqual(same.filter((key) => key.startsWith("phase.") || key.startsWith("failure.") || key.startsWith("do.")), []);
});

test("every catalogue holds what a person at a running robot needs", () => {
  assert.match(speaker("de")("phase.fast search", { touch: "Antastung 3" }), /^Antastung 3: schnelle Suche\.$/);
  assert.match(speaker("de")("standing.broken.since", { since: "11. Dez." }), /^Festgestellt 11\. Dez\. Vorher/, "one full stop");
  assert.match(speaker("en")("progress.touches", { n: 3, total: 9 }), /^3 of 9 touches$/);
});

test("one of a thing is said in the singular", () => {
  for (const [n, en_end, de_end] of [[1, "1 touch.", "nach 1 Antastung fehlgeschlagen."], [2, "2 touches.", "nach 2 Antastungen fehlgeschlagen."]] as const) {
    assert.ok(speaker("en")("phase.failed", { session: 4, n }).endsWith(en_end));
    assert.ok(speaker("de")("phase.failed", { session: 4, n }).endsWith(de_end));
  }
  const plural = Object.keys(en).filter((key) => key.endsWith(".one")).map((key) => key.slice(0, -4));
  assert.deepEqual(plural.filter((key) => !(key in en)), []);
});

test("a sentence with a text that no catalogue has is in English", () => {
  const device = "/dev/contact2: no such device. Plug the sensor in (ports found: none)";
  const way = "Then: 'cellcal run --cell c.toml --touches 9'", weg = "Danach: 'cellcal run --cell c.toml --touches 9'";
  assert.equal(language_of(device, device, "de"), "en");
  assert.equal(language_of(`${device}. ${weg}`, `${device}. ${way}`, "de"), "en");
  assert.equal(language_of(`Antastung 9 an S2: kein Kontakt auf 24,0 mm. ${weg}`, `touch 9 on S2: no contact within 24.0 mm. ${way}`, "de"), "de");
});

test("numbers have the language's decimal mark and always their unit", () => {
  assert.equal(formats("de").mm(0.1234), "0,123\u00a0mm");
  assert.equal(formats("en").mm(0.1234), "0.123\u00a0mm");
  assert.equal(formats("en").mm(null), "–");
  assert.equal(formats("en").duration(3725), "1\u00a0h 2\u00a0min");
  assert.equal(formats("en").time("not a time"), "–");
});

test("the ticks of a chart are days, and times where a day has several", () => {
  const at = (day: number, hour: number, minute = 0, second = 0) => new Date(2026, 10, day, hour, minute, second).getTime() / 1000;
  assert.deepEqual(tick_words([at(30, 14), at(30, 14, 30), at(30, 15)], "de"), ["14:00\n30. Nov. 26", "14:30", "15:00"]);
  assert.deepEqual(tick_words([at(28, 0), at(28, 12), at(29, 0), at(29, 12)], "en"), ["00:00\nNov 28, 26", "12:00", "00:00\nNov 29, 26", "12:00"]);
  assert.deepEqual(tick_words([at(30, 14), at(30, 14, 0, 20)], "en").at(-1), "14:00:20");
  assert.deepEqual(tick_words([at(28, 0), at(29, 0)], "en"), ["Nov 28, 26", "Nov 29, 26"]);
});

test("a shift of the TCP is not written as its bound is", () => {
  assert.equal(speaker("en")("outcome.shift", { shift: "0.015 ± 0.079 mm" }), "TCP shift 0.015 ± 0.079 mm (k=2)");
  assert.match(speaker("de")("outcome.shift"), /^TCP-Verschiebung/);
});

test("a calibration has as many touches where it is started, in the guide and in its commands", () => {
  assert.deepEqual(run_request({ ...WHOLE, cell: "/c/cell.toml" }), { cell: "/c/cell.toml", touches: 100, check: 10 });
  for (const step of ["spheres", "dry-run", "calibration"] as const) assert.match(command_of(step, "/c/cell.toml"), / --touches 100 --check 10$/);
  for (const language of Object.keys(CATALOGUES)) assert.match(speaker(language)("step.do.calibration"), /^100 /);
});

test("a wish becomes the request that the daemon takes", () => {
  const wish = { kind: "calibrate" as const, cell: " /c/cell.toml ", touches: "30", check: "5", goal: "", load: "", find: false };
  assert.deepEqual(run_request(wish), { cell: "/c/cell.toml", touches: 30, check: 5 });
  assert.deepEqual(run_request({ ...wish, goal: "0,15", find: true }), { cell: "/c/cell.toml", goal_mm: 0.15, check: 5, find: true });
  assert.deepEqual(run_request({ ...wish, goal: " 0.15 mm" }), { cell: "/c/cell.toml", goal_mm: 0.15, check: 5 });
  assert.deepEqual(run_request({ ...wish, kind: "qualify", find: true }), { cell: "/c/cell.toml", kind: "qualify" });
  assert.deepEqual(run_request({ ...wish, kind: "update", find: true }), { cell: "/c/cell.toml", update: true });
  assert.deepEqual(run_request({ ...wish, kind: "check", load: " part " }), { cell: "/c/cell.toml", kind: "check", load: "part" });
  assert.deepEqual(run_request({ ...wish, kind: "check" }), { cell: "/c/cell.toml", kind: "check" });
});

test("the page has words for every outcome that a session has, as a sentence and in the history", () => {
  assert.deepEqual([...OUTCOMES].sort(), own_names("daemon/result/outcome.h", "OutcomeKind").sort());
  assert.deepEqual([...NOT_AS_STATED], own_names("daemon/result/qualification.h", "QualificationFinding", "-"));
  const keys: string[] = [...OUTCOMES.flatMap((one) => [`outcome.${one}`, `history.${one}`]),
    ...CHANGES.map((one) => `outcome.change.${one}`)];
  assert.deepEqual(keys.filter((key) => !(key in en)), []);
});

test("drift is told against the oldest session that has the joint", () => {
  const row = (session: number, deg: number | null) => ({ session, ended: "", publish: true, fit_mm: 0, check_mm: 0, workspace_mm: 0,
    zeros: deg === null ? [] : [{ joint: "A1", deg, sigma_deg: 0.001 }] });
  assert.deepEqual(zero_changes([row(1, null), row(2, 0.5), row(3, 0.75)]), [{ joint: "A1", values: [null, 0, 0.25] }]);
  assert.deepEqual(published([{ ...row(1, 0.1), publish: false }, row(2, 0.5)]), [row(2, 0.5)], "a withheld result is no drift");
});

test("the page has words for every state, advice and cause that a control chart has", () => {
  const named = (file: string, type: string) => own_names(`calib/result/${file}`, type).sort();
  assert.deepEqual([...DRIFT_STATES].sort(), named("drift_chart.h", "DriftState"));
  assert.deepEqual([...ADVICE].sort(), named("drift_chart.h", "DriftAdvice"));
  assert.deepEqual([...CHANGES, "nothing"].sort(), named("tcp_check.h", "ChangeKind"));
  const keys: string[] = [...DRIFT_STATES.map((one) => `checks.state.${one}`), ...CHANGES.map((one) => `checks.cause.${one}`),
    ...ADVICE.filter((one) => one !== "none").map((one) => `checks.advice.${one}`)];
  assert.deepEqual(keys.filter((key) => !(key in en)), []);
});
