// The first line: validity of the calibration, accuracy, date, required action. And access to the arm.

import assert from "node:assert/strict";
import { test } from "node:test";
import * as decode from "../src/decode";
import { formats } from "../src/format";
import { may_move, near_words } from "../src/sentence";
import { age_words, cell_name, now_of, standing_line, type Now } from "../src/standing";
import * as api from "../generated/api";
import { speaker } from "../src/words";
import { date_of, drawn, plotted } from "../src/ui/checks";
import { status, words_of } from "./kr5";

const HOLDINGS = words_of(api.Holding), ADVICE = words_of(api.Advice), CHANGES = words_of(api.ChangeKind).filter((one) => (one as string) !== "nothing");
const HOUR = 3600, DAY = 86400;
// In this year: dates of other years include the year.
const CALIBRATED = `${new Date().getFullYear()}-11-25T12:00:00.000Z`, CALIBRATED_S = Date.parse(CALIBRATED) / 1000;
const NOW_S = CALIBRATED_S + 2 * DAY;
const say = speaker("en"), fmt = formats("en");

const checks = (more: object = {}) => ({
  calibration: 7, calibrated: CALIBRATED, cell: "/c/weld-3.toml", state: "in_control", advice: "none", counted: 6, least: 5, undecided: 0,
  standing: { holds: "holds", by_check: true, evidence_s: NOW_S - 2 * HOUR, due_s: NOW_S + 14 * DAY - 2 * HOUR },
  warns: { ewma: 3, cusum: 4, run_length: 200 }, alarms: { ewma: 4, cusum: 5, run_length: 1000 }, course: null, points: [], ...more,
});
const standing = (more: object) => ({ standing: { ...checks().standing, ...more } });
const not_held = (more: object = {}) => ({
  ...standing({ holds: "does_not_hold" }), state: "alarms", advice: "re_measure_tcp",
  not_held: { session: 12, time_s: NOW_S - HOUR, since: 11, since_s: NOW_S - DAY, checks: 2, tcp_shift_mm: 1.0, u_tcp_shift_mm: 0.1,
              cause: { kind: "tool", name: "torch", probability: 0.99, words: "" }, ...more },
});
const version = (more: object = {}) =>
  ({ session: 7, ended: CALIBRATED, scope: "workspace", predicted_mm: 0.08, u95_mm: 0.104, active: true, trouble: "", activated: null, ...more });
const line = (chart: object | null, versions: object[] = [version()], language: "en" | "de" = "en", more: object = {}) =>
  standing_line({ drift: decode.drift({ checks: chart }), versions: decode.versions(versions), readiness: null, now: "calm", cell: "/c/weld-3.toml", ...more },
                NOW_S, speaker(language), formats(language));

test("a calibration that holds says how good it is, since when, and when it is to be checked", () => {
  const got = line(checks());
  assert.deepEqual([got.state, got.action], ["holds", "check"]);
  assert.equal(got.headline.replace(/\u00a0/g, " "), "Calibration of 25 Nov holds: TCP ±0.10 mm (95 %), checked 2 h ago");
  assert.match(got.more.join(" "), /^Check once per shift\. Without one the state becomes unknown on 11\u00a0Dec\.$/);
  const unchecked = line(checks(standing({ by_check: false, evidence_s: CALIBRATED_S })));
  assert.match(unchecked.headline, /made 2 days ago, not checked since/);
  const german = line(checks(), [version({ scope: "near targets" })], "de");
  assert.match(german.more.join(" "), /^Einmal je Schicht prüfen\. Sonst ist der Zustand ab 11\.\u00a0Dez\.? unbekannt\.$/);
  assert.match(german.headline.replace(/\u00a0/g, " "), /^Kalibrierung vom 25\. Nov\.? gilt: TCP ±0,10 mm \(95 %\) nahe den Kugeln, geprüft vor 2 Std\.$/);
});

test("a calibration whose cell file has changed since is unknown and is made anew", () => {
  const readiness = (more: object) => decode.readiness({ steps: [{ step: "calibration", state: "wrong", words: "changed", session: 7, ...more }] });
  const got = line(checks(), [version()], "en", { readiness: readiness({}) });
  assert.deepEqual([got.state, got.action], ["unknown", "calibrate"]);
  assert.match(got.headline, /the cell file or its robot file has changed since$/);
  for (const other of [{ state: "done" }, { session: 6 }])
    assert.equal(line(checks(), [version()], "en", { readiness: readiness(other) }).state, "holds");
});

test("nothing is to be done only while nothing runs, nothing has failed and the daemon answers", () => {
  const told = (now: Now, chart: Record<string, unknown> | null = checks()) => line(chart, chart ? [version()] : [], "en", { now }).more.join(" ");
  assert.match(told("running"), /^Wait for the session\. Check once per shift\. Without one the state becomes unknown on 11\u00a0Dec\.$/);
  for (const now of ["amiss", "lost"] as const) assert.match(told(now), /^Check once per shift\. Without one the state becomes unknown on 11\u00a0Dec\.$/);
  for (const now of ["amiss", "lost"] as const) assert.equal(told(now, null), "", "the failed session has its own button");
  assert.notEqual(told("withheld", null), "");
  const now = (more: Record<string, unknown>, old = false) => now_of(decode.status(status(more)), old);
  const ended = { running: false, phase: "done" };
  assert.deepEqual([now({}), now(ended), now({ ...ended, phase: "failed" }), now({ ...ended, phase: "aborted" }), now({}, true), now_of(null, false)],
    ["running", "calm", "amiss", "amiss", "lost", "calm"]);
  assert.equal(now({ ...ended, outcome: { kind: "withheld", good: false } }), "withheld");
  const left = { session: 2, touches: 5, planned: 9, started: "", ending: "interrupted", anew: "" };
  assert.deepEqual([null, left].map((interrupted) => now({ running: false, phase: "idle", interrupted })), ["calm", "amiss"]);
});

test("an emulated cell, whose clock gives no age, has none", () => {
  assert.match(line(checks(standing({ evidence_s: 9.5e8, due_s: null }))).headline, /^Calibration of the emulated cell holds: TCP ±0\.10\u00a0mm \(95 %\), checked$/);
  const unchecked = line(checks(standing({ by_check: false, evidence_s: 9.5e8, due_s: null })));
  assert.match(unchecked.headline, /, not checked yet$/);
  assert.equal(unchecked.more.join(" "), "Nothing to do.");
  assert.match(line(checks({ ...standing({ holds: "unknown", due_s: null }), undecided: 1 })).headline, /undecided/);
});

test("a drift that warns is said although the calibration holds", () => {
  assert.match(line(checks({ state: "warns", advice: "check_again" })).more.join(" "), /^Warning: the TCP drifts\. .*check again/);
});

test("a calibration that does not hold names the cause, its size, the remedy and its begin", () => {
  const got = line(checks(not_held()));
  assert.deepEqual([got.state, got.action], ["does_not_hold", "measure_tcp"]);
  assert.equal(got.headline.replace(/\u00a0/g, " "), "Calibration of 25 Nov does not hold: tool shifted by 1.0 ± 0.1 mm (k=2)");
  assert.match(got.more.join(" ").replace(/\u00a0/g, " "), /measure the TCP .* Found 26 Nov\. Before: TCP ±0\.10 mm/);
  for (const kind of CHANGES) {
    const other = line(checks(not_held({ cause: { kind, name: "S2", probability: 1, words: "" } })));
    assert.doesNotMatch(other.headline, /undefined|[{}]/, kind);
    assert.equal(other.state, "does_not_hold");
  }
  assert.match(line(checks(not_held({ cause: null, tcp_shift_mm: null }))).headline, /spheres were not met/);
  const crept = { ...standing({ holds: "does_not_hold" }), state: "alarms", advice: "re_measure_tcp",
                  course: { shape: "creep", since: 9, since_s: NOW_S - DAY, off_mm: 0.3, u_off_mm: 0.02, mm_per_month: 0.1, causes: [] } };
  assert.match(line(checks(crept)).headline, /TCP shifted by 0\.30\u00a0±\u00a00\.02\u00a0mm/);
});

test("it never holds where cellcald does not say so", () => {
  const unknown = standing({ holds: "unknown" });
  const late = line(checks(standing({ holds: "unknown", evidence_s: NOW_S - 16.2 * DAY, due_s: NOW_S - 2.2 * DAY })));
  assert.equal(late.headline.replace(/\u00a0/g, " "), "Calibration of 25 Nov unknown: no check for 16 days");
  assert.deepEqual([late.state, late.action], ["unknown", "check"]);
  assert.match(late.more.join(" "), /^Check now, about 20 s\. When it last held: TCP ±/);
  assert.match(line(checks({ ...unknown, undecided: 1 })).headline, /newest check is undecided/);
  assert.match(line(checks({ ...unknown, state: "alarms", advice: "check_again" })).headline, /contradicts those before/);
  for (const value of [undefined, null, 3, {}, { holds: "perhaps", evidence_s: 1, due_s: 2 }, { holds: "holds", evidence_s: "x", due_s: 1 }])
    assert.equal(line(checks({ standing: value })).state, "unknown", "of an older daemon");
  for (const holds of HOLDINGS)
    for (const advice of ADVICE)
      for (const state of ["too_few", "in_control", "warns", "alarms", "unknown"])
        assert.equal(line(checks({ ...standing({ holds }), advice, state })).state, holds);
});

test("without a calibration, or with a damaged one, it says so and what comes next", () => {
  const none = line(null, []);
  assert.deepEqual([none.state, none.action], ["none", "calibrate"]);
  const readiness = decode.readiness({ cell: "", robot: "", spheres: 0, placed: 0, next: "qualify", steps: [] });
  const led = line(null, [], "en", { readiness });
  assert.deepEqual([led.action, led.more.join(" ")], [null, "Follow the steps below. Next: Qualification."]);
  assert.equal(line(null, [], "en", { readiness, now: "running" }).more.join(" "), "Wait for the session.");
  const damaged = line(null, [version({ trouble: "session 7: damaged" })]);
  assert.deepEqual([damaged.state, damaged.more], ["unknown", ["session 7: damaged"]]);
  assert.equal(line(null).state, "unknown", "published, but not judged");
  const seen = { drift: decode.drift({ checks: checks() }), versions: decode.versions([version()]), readiness: null, now: "calm" as const, cell: "" };
  for (const missing of [{ drift: null, versions: null }, { drift: null }, { versions: null }])
    assert.equal(standing_line({ ...seen, ...missing }, NOW_S, say, fmt).state, "pending");
  const lost = decode.versions([version({ trouble: "session 7: damaged" })]);
  assert.match(standing_line({ ...seen, drift: null, versions: lost }, NOW_S, say, fmt).headline, /session 7 is damaged/);
});

test("an accuracy that is not stated is not invented", () => {
  assert.match(line(checks(), [version({ u95_mm: null })]).headline, /TCP 0\.080\u00a0mm on the mean/);
  assert.match(line(checks(), []).headline, /accuracy not stated/);
});

test("an age has its largest unit, and none is negative", () => {
  assert.deepEqual([-5, 30, 600, 2 * HOUR, 47 * HOUR, 16.9 * DAY].map((s) => age_words(s, say)),
    ["1 min", "1 min", "10 min", "2 h", "47 h", "16 days"]);
  assert.equal(age_words(16 * DAY, speaker("de")), "16 Tagen");
});

test("a calibration of another cell than the page's is named with its cell", () => {
  assert.match(line(checks(), [version()], "en", { cell: "/c/weld-2.toml" }).headline, /^Calibration of 25\u00a0Nov \(weld-3\) holds/);
});

test("a cell is named by its file, or by its folder where the file is named as every one", () => {
  assert.deepEqual(["/etc/cellcal/weld-3.toml", "/sim/demo/cell.toml", "/etc/cellcal/cell.toml", "/s/cells/cell.toml", "cell.toml", ""].map(cell_name),
    ["weld-3", "demo", "cell", "cell", "cell", ""]);
});

const of = (more: Record<string, unknown> = {}) => decode.status(status(more))!;
const MANNED = { held: null, open: false, next_utc_s: null };
const near = (one: Record<string, unknown> | null, schedule: unknown = MANNED) => near_words(one && of({ schedule, ...one }), NOW_S, say, fmt);

test("nobody is told to go near while something may move, nor that it is safe", () => {
  const rest = { arm: { motion: "at rest", packet_age_s: 0.1 } };
  assert.match(near({}), /^Keep out: the arm moves/);
  assert.match(near({ ...rest, phase: "planning" }), /^Keep out: a session runs/);
  assert.match(near(null), /^Keep out: .*unknown/);
  const lost = { phase: "failed", running: false, failure: { kind: "stop-unconfirmed", detail: "" }, ...rest };
  assert.match(near(lost), /^Keep out: .*unknown/);
  const idle = { phase: "idle", running: false, arm: undefined };
  assert.match(near(idle), /^cellcal moves nothing\. Enter by the rules/);
  for (const unread of [null, 3, {}, { held: null }, { next_utc_s: 5 }])
    assert.match(near(idle, unread), /^Keep out: .*unknown/, "until a schedule is read");
  const next = { ...MANNED, next_utc_s: NOW_S + HOUR };
  assert.match(near(idle, next), /until 27\u00a0Nov, \d\d:\d\d: then a session may begin by itself/);
  assert.match(near(idle, { ...next, open: true }), /^Keep out/, "open by the daemon's clock, not yet by a slow one here");
  assert.match(near(idle, { ...next, next_utc_s: NOW_S - 1 }), /^Keep out/);
  assert.match(near(idle, { ...next, open: true, held: "the clock was set" }), /^Keep out/, "a hold that ends by itself");
  assert.match(near(idle, { ...MANNED, held: "failed" }), /^cellcal moves nothing\. Enter/);
  assert.deepEqual([of(), of({ ...rest }), of(lost), of({ running: false, phase: "aborted" }), of(idle)].map(may_move), [true, true, true, true, false]);
});

test("checks that fail for another reason than the tool are drawn, though they do not count", () => {
  const one = { session: 8, time_s: 1e9, holds: true, left_out: null, off_mm: [0, 0, 0], ewma: 1, cusum: 1, share: 0.2, state: "in_control" };
  const failing = { ...one, session: 9, time_s: 2e9, holds: false, left_out: "not_the_tool", off_mm: null, share: 0, state: "alarms" };
  const points = decode.drift({ checks: checks({ points: [failing, one, { ...failing, session: 10, holds: null }] }) }).checks!.points;
  assert.deepEqual(plotted(points).map((point) => point.session), [8]);
  assert.deepEqual(drawn(points).map((point) => point.session), [8, 9]);
});

test("days of the control chart are those of the browser's zone, as in the history", () => {
  const zone = process.env.TZ;
  const at_utc = (time: string) => date_of(Date.parse(time) / 1000);
  process.env.TZ = "Asia/Tokyo";
  assert.equal(at_utc("2026-11-30T22:30:00Z"), "2026-12-01");
  process.env.TZ = "America/Los_Angeles";
  assert.equal(at_utc("2026-12-01T03:00:00Z"), "2026-11-30");
  if (zone === undefined) delete process.env.TZ;
  else process.env.TZ = zone;
});
