import assert from "node:assert/strict";
import { test } from "node:test";
import * as decode from "../src/decode";
import * as fleet from "../src/fleet/decode";
import { drawn_of_all, off_mm, plotted } from "../src/ui/checks";
import { kr5, status } from "./kr5";

const HOSTILE: unknown[] = [
  null, undefined, true, 7, -1, NaN, Infinity, 1e308, "", "x".repeat(1e6), [], [[]], {}, { seq: 1 },
  { seq: "1", phase: "idle" }, { seq: NaN, phase: "idle" }, [1, 2, 3], { touches: 1e9 },
  { __proto__: null }, { index: -1 }, { index: 1.5 }, { joints: [null] }, { joints_deg: ["x"] },
  { sessions: [null, 3, {}, { id: "1" }] }, { role: "root" }, { role: ["operate"] },
  JSON.parse('{"__proto__": {"role": "administer"}, "constructor": 1}'),
];
const DECODERS = {
  status: decode.status, touch: decode.touch, posture: decode.posture, scene: decode.scene,
  plan: decode.plan, figures: decode.figures, sessions: decode.sessions, drift: decode.drift, plots: decode.plots,
  readiness: decode.readiness, versions: decode.versions, comparison: decode.comparison, proposals: decode.proposals, doctor: decode.doctor, role: decode.role, error_words: decode.error_words, fleet_cells: fleet.cells, fleet_cell: fleet.cell_seen, corrections: fleet.corrections,
  certificate_files: fleet.certificate_files,
};

test("nothing that arrives makes a decoder throw, or gives a role", () => {
  for (const [name, one] of Object.entries(DECODERS))
    for (const value of HOSTILE) assert.doesNotThrow(() => one(value), name);
  for (const value of HOSTILE) assert.equal(decode.role(value), null);
});

test("a status has the warnings of cell file and plan", () => {
  assert.deepEqual(decode.status(status({ warnings: ["required_mm = 0.01", 3, ""] }))?.warnings, ["required_mm = 0.01"]);
  assert.deepEqual(decode.status(status({ warnings: undefined }))?.warnings, []);
});

test("a status with any one of its fields of a wrong type is a status without that field", () => {
  const whole = status();
  for (const key of Object.keys(whole)) {
    for (const value of HOSTILE) {
      const got = decode.status({ ...whole, [key]: value });
      if (key === "seq" || key === "phase") continue;
      assert.ok(got, key);
      assert.equal(got.seq, 7);
      for (const number of [got.residual_mm, got.u95_mm, got.time_left_s]) assert.ok(number === null || Number.isFinite(number));
    }
  }
});

test("a status without a number or a phase is none", () => {
  assert.equal(decode.status({ ...status(), seq: undefined }), null);
  assert.equal(decode.status({ ...status(), phase: 3 }), null);
});

test("a phase and a failure that this page does not know are unknown, not something else", () => {
  assert.equal(decode.status(status({ phase: "levitating" }))?.phase, "unknown");
  assert.equal(decode.status(status({ phase: "toString" }))?.phase, "unknown");
  assert.equal(decode.status(status({ failure: { kind: "gremlins", detail: "x" } }))?.failure?.kind, "unknown");
});

test("a proposal that this page does not know is not shown as another one", () => {
  const one = { id: "p-1", kind: "activate", session: 7, text: "", by: "M. Huber", reason: "drift", received: "t", stand: "open", decided: null, file: null };
  assert.equal(decode.proposals({ problem: null, proposals: [one] })?.proposals[0]?.session, 7);
  for (const wrong of [{ kind: "move" }, { stand: "begun" }, { id: "" }, { id: 3 }])
    assert.deepEqual(decode.proposals({ proposals: [{ ...one, ...wrong }] })?.proposals, []);
});

test("a cell of the plant that needs what this page does not know is not shown as well", () => {
  const row = { plant: "graz", cell: "weld-3", online: true, calibration: 7, held: "yes", needs: [{ what: "repainted", since: "t", detail: "" }] };
  assert.equal(fleet.cells({ cells: [row] })?.[0]?.needs[0]?.what, "unknown");
  assert.equal(fleet.cells({ cells: [{ ...row, held: "perhaps" }] })?.[0]?.held, null);
  assert.deepEqual(fleet.cells({ cells: [{ ...row, cell: "" }, 3, null] }), []);
  assert.equal(fleet.cells([row]), null);
  assert.deepEqual(fleet.certificate_files({ files: [{ name: "a.html", base64: "<b>" }, { name: "a.html", base64: "PGI" }, { name: "a.html", base64: "PGI+" }] }), [{ name: "a.html", base64: "PGI+" }]);
});

test("an update of a cell of the plant that finds nothing changed is not withheld", () => {
  assert.equal(fleet.verdict({ published: false, findings: ["update_not_needed"] }), "history.nothing_changed");
  assert.equal(fleet.verdict({ published: false, findings: ["changed"] }), "fleet.withheld");
  assert.equal(fleet.verdict({ published: true, findings: [] }), "fleet.published");
});

test("a text of a cell does not turn around the sentence that holds it", () => {
  const sessions = fleet.cell_seen({ state: {}, sessions: [{ session: 1, state: "failed", failure: "a\u202Eb\u2066c\n" }] })?.sessions;
  assert.equal(sessions?.[0]?.failure, "a b c\n");
});

test("corrections are those of the joint that is asked for, and asked for again when a cell has another calibration", () => {
  const all = fleet.corrections({ corrections: [{ plant: "graz", cell: "weld-3", correction: 0.1, sigma: 0.01 }] })!;
  assert.equal(fleet.of_asked({ asked: "joint=A1", all }, "joint=A1"), all);
  assert.equal(fleet.of_asked({ asked: "joint=A1", all }, "joint=A2"), null);
  assert.equal(fleet.of_asked(null, null), null);
  const key = (more: object) => fleet.calibrations_in_use(fleet.cells({ cells: [{ plant: "graz", cell: "weld-3", journal: "j", calibration: 7, needs: [], ...more }] })!);
  assert.equal(key({ online: true }), key({ online: false }));
  for (const other of [{ calibration: 8 }, { calibration: null }, { journal: "k" }, { cell: "weld-4" }]) assert.notEqual(key(other), key({}));
});

test("two calibrations that cannot be compared have no distance", () => {
  const all = { comparable: false, mean_mm: 1, max_mm: 2, expected_mm: null, moved: [{ name: "theta_A3" }] };
  assert.equal(decode.comparison(all)?.mean_mm, null);
  assert.equal(decode.comparison({ ...all, comparable: true })?.mean_mm, 1);
  assert.deepEqual(decode.comparison({ ...all, only_after: ["S5.x", 7] })?.only_after, ["S5.x"]);
  assert.deepEqual(decode.comparison({ ...all, not_compared: ["tool.x", 7] })?.not_compared, ["tool.x"]);
});

test("text that is cut off is nothing", () => {
  const text = JSON.stringify(status());
  for (let cut = 0; cut < text.length; cut += 7) assert.equal(decode.status(decode.parse(text.slice(0, cut))), null);
});

test("words and lists are cut to what a page can bear", () => {
  const got = decode.status(status({ target: "S".repeat(1e6), reasons: Array(1e5).fill("r") }));
  assert.ok(got && got.target.length < 5000 && got.reasons.length <= 5000);
});

test("a scene is taken whole, and not at all where its arm cannot be placed", () => {
  assert.equal(decode.scene(kr5())?.joints.length, 6);
  assert.equal(decode.scene({ ...kr5(), base: [1, 2] }), null);
  assert.equal(decode.scene({ ...kr5(), joints: [] }), null);
  assert.equal(decode.scene({ ...kr5(), joints: [...kr5().joints, { name: "A7" }] }), null);
  assert.equal(decode.scene({ ...kr5(), joints: Array(1000).fill(kr5().joints[0]) }), null);
  const axis = { name: "E1", sign: 1, frame: kr5().base };
  assert.equal(decode.scene({ ...kr5(), positioner: [axis] })?.positioner.length, 1);
  for (const wrong of [{ ...axis, frame: [1] }, { ...axis, sign: 2 }, null]) assert.equal(decode.scene({ ...kr5(), positioner: [axis, wrong] }), null);
});

test("a doctor's check that the page does not know keeps its name", () => {
  const got = decode.doctor({ checks: [{ check: "rsi port", outcome: "ok" }, { check: "new check", outcome: "failed" }] });
  assert.deepEqual(got?.checks.map((one) => one.check), ["rsi port", "new check"]);
});

test("a mesh whose triangles lie outside its corners is left out", () => {
  const mesh = (corner: number) => ({ id: "m", shape: "mesh", frame: kr5().base, vertices_mm: [0, 0, 0, 1, 0, 0, 0, 1, 0], triangles: [0, 1, corner] });
  assert.equal(decode.scene({ ...kr5(), obstacles: [mesh(2)] })?.obstacles.length, 1);
  for (const corner of [3, -1, 0.5, 1e9]) assert.equal(decode.scene({ ...kr5(), obstacles: [mesh(corner)] })?.obstacles.length, 0);
});

const chart = (more: object = {}) => ({
  calibration: 7, state: "alarms", advice: "re_measure_tcp", counted: 2, least: 5,
  warns: { ewma: 3, cusum: 4, run_length: 200 }, alarms: { ewma: 4, cusum: 5, run_length: 1000 }, course: null,
  points: [
    { session: 9, time_s: 2e9, left_out: null, off_mm: [0.3, 0.4, 0], ewma: 4, cusum: 1, share: 1, state: "alarms", temperature_c: 21.5 },
    { session: 8, time_s: 1e9, left_out: null, off_mm: [0, 0, 0], ewma: 1, cusum: 1, share: 0.2, state: "in_control" },
  ], ...more,
});

test("a control chart is taken whole, in the order of time, and not at all without limits", () => {
  const got = decode.drift({ checks: chart() }).checks;
  assert.ok(got);
  assert.deepEqual(plotted(got.points).map((one) => one.session), [8, 9]);
  assert.equal(off_mm(got), 0.5);
  assert.deepEqual(got.points.map((one) => one.temperature_c).sort(), [null, 21.5].sort());
  for (const alarms of [null, {}, { ewma: 0, cusum: 5 }, { ewma: "4", cusum: 5 }, { ewma: -1, cusum: 5 }])
    assert.equal(decode.drift({ checks: chart({ alarms }) }).checks, null);
  assert.equal(decode.drift({ checks: chart({ state: "levitates" }) }).checks, null);
  const aged = decode.drift({ checks: chart({ state: "unknown", undecided: 3, decided_s: 1e9 }) }).checks;
  assert.deepEqual([aged?.state, aged?.undecided, aged?.decided_s], ["unknown", 3, 1e9]);
  assert.equal(decode.drift({ checks: chart({ decided_s: null }) }).checks?.decided_s, null);
  assert.equal(decode.drift({ checks: chart({ advice: "dance" }) }).checks?.advice, "none");
  assert.equal(decode.drift({ checks: null }).checks, null);
});

test("the trend of a chart and what the controller has acknowledged are read by the keys that the API has for them", () => {
  const course = { shape: "creep", since: 47, since_s: 1e9, off_mm: 0.3, mm_per_month: 0.1, causes: [{ kind: "tool", name: "torch", probability: 0.9 }] };
  const trend = decode.drift({ checks: chart({ course }) }).checks?.course;
  assert.deepEqual([trend?.shape, trend?.since, trend?.mm_per_month, trend?.causes[0]?.kind, trend?.causes[0]?.name], ["creep", 47, 0.1, "tool", "torch"]);
  assert.equal(decode.drift({ checks: chart({ course: { ...course, off_mm: null } }) }).checks?.course, null);
  const controller = { told: "holds", value: 1, told_at: "2026-03-05T22:00:00.000Z", trouble: null };
  assert.deepEqual(decode.drift({ controller }).controller, { ...controller, trouble: "" });
  assert.equal(decode.drift({ controller: null }).controller, null);
});

test("the outcome of a session is read by the keys that the API has for it, and of no calibration is published or withheld", () => {
  const outcome = {
    kind: "does_not_hold", good: false, touches: 8, tcp_shift_mm: { xyz: [0.8, -0.5, 0.3], length: 0.99, u_length: 0.05 },
    change: { kind: "tool", name: "probe", probability: 0.99, touch: null, shift_mm: [0.8, -0.5, 0.3], value: 0.99, u: 0.05, unit: "mm" },
    not_found: ["S2"], unsteady: [], zeros: [], remedy: "re_measure_tcp", spheres: [], not_as_stated: [],
  };
  const row = (more: object) => decode.sessions([{ id: 7, kind: "check", state: "done", ...more }])[0];
  const got = row({ outcome })?.outcome;
  assert.deepEqual([got?.kind, got?.good, got?.tcp_shift_mm?.length, got?.tcp_shift_mm?.u_length, got?.change?.kind, got?.remedy, got?.not_found],
    ["does_not_hold", false, 0.99, 0.05, "tool", "re_measure_tcp", ["S2"]]);
  for (const none of [null, undefined, 3, {}, { ...outcome, kind: "levitates" }]) assert.equal(row({ outcome: none })?.outcome, null);
  const sphere = { target: "S1", centre_mm: [1, 2, 3], u_mm: 5, touches: 9, moved_mm: null };
  const found = row({ outcome: { ...outcome, kind: "found", good: true, spheres: [sphere, 3, { ...sphere, centre_mm: [1] }] } })?.outcome;
  assert.deepEqual(found?.spheres, [{ target: "S1", centre_mm: [1, 2, 3], u_mm: 5, touches: 9, moved_mm: null, on: "", taught_deg: [] }]);
  const failing = { session: 8, time_s: 1e9, since: 2, since_s: 9e8, checks: 7, tcp_shift_mm: 0.99, u_tcp_shift_mm: 0.05,
    cause: { kind: "tool", name: "probe", probability: 0.99, words: "" } };
  const held = decode.drift({ checks: chart({ state: "alarms", not_held: failing }) }).checks?.not_held;
  assert.deepEqual([held?.session, held?.since, held?.tcp_shift_mm, held?.cause?.kind], [8, 2, 0.99, "tool"]);
  assert.equal(decode.drift({ checks: chart() }).checks?.not_held, null);
});

test("a point of a control chart that was not measured, or at no date, is not drawn", () => {
  const one = chart().points[0];
  const points = [{ ...one, off_mm: null }, { ...one, left_out: "undecided" }, { ...one, left_out: "of another moon" }, { ...one, time_s: 1e300 }, { ...one, time_s: "x" }, 3];
  const got = decode.drift({ checks: chart({ points }) }).checks;
  assert.ok(got);
  assert.deepEqual(plotted(got.points), []);
  assert.equal(off_mm(got), null);
});

test("checks of other calibrations are drawn apart, between the changes of the cell", () => {
  const point = (session: number, time_s: number) =>
    ({ session, time_s, holds: true, off_mm: [0.01, 0, 0], ewma: 1, cusum: 1, share: 0.3, state: "in_control", temperature_c: null, left_out: null });
  const got = decode.drift({ checks: chart({
    points: [point(8, 300), point(9, 400)], others: [{ calibration: 2, points: [point(3, 100), point(4, 200)] }, 7, null],
    events: [{ kind: "updated", session: 7, time_s: 250, words: "update of session 7" }, { time_s: "soon" }, null],
  }) }).checks;
  assert.ok(got);
  const { points, breaks } = drawn_of_all(got);
  assert.deepEqual(points.map((one) => one.session), [3, 4, 8, 9]);
  assert.deepEqual(breaks, [[200, 300]]);
  assert.deepEqual(got.events.map((one) => [one.session, one.time_s, one.words]), [[7, 250, "update of session 7"]]);
  assert.deepEqual(decode.drift({ checks: chart() }).checks?.others, [], "of an earlier daemon");
});

test("a drawing is whole or none", () => {
  const plots = decode.plots({ before_after: "<svg/>", by_joint: ["<svg/>", 3, ""], error_map: "x".repeat(5_000_000) });
  assert.deepEqual(plots, { session: 0, before_after: "<svg/>", by_joint: ["<svg/>"], error_map: "" });
});

test("a link's counts that do not come are unknown, not none", () => {
  const link = (robot: object) => decode.status(status({ links: { open: true, robot, contact: {} } }))?.links;
  assert.deepEqual([link({ late: 3 })?.robot.late, link({ late: 3 })?.robot.gaps, link({ gaps: -1 })?.robot.gaps], [3, null, null]);
  assert.deepEqual([link({})?.robot.mode, link({})?.contact.loop_ok, link({ reply_ms: { p99: Infinity } })?.robot.reply_ms.p99], ["unknown", null, null]);
});

test("what a silent sensor has not sent is unknown", () => {
  const contact = decode.status(status({ links: { open: true, robot: {}, contact: { frames: 9, in_contact: null, loop_ok: null, round_trip_ms: null, clock_sigma_us: null } } }))?.links?.contact;
  assert.deepEqual([contact?.frames, contact?.in_contact, contact?.loop_ok, contact?.round_trip_ms, contact?.clock_sigma_us], [9, null, null, null, null]);
});

test("angles are those of an arm, and finite, or none", () => {
  const at = (joints_deg: unknown) => decode.posture({ session: 3, joints_deg });
  assert.deepEqual(at([1, 2.5]), { session: 3, joints_deg: [1, 2.5], positioner_deg: [] });
  for (const wrong of [[], [1, null], [1, NaN], [1, "2"], Array(33).fill(0), { 0: 1 }, "1"]) assert.equal(at(wrong), null);
  assert.deepEqual(decode.touch({ index: 0, joints_deg: Array(33).fill(0), tip_mm: [0, 1] }),
    { session: 0, index: 0, target: "", set: "fit", joints_deg: [], tip_mm: null, residual_mm: null, u95_mm: null, positioner_deg: [] });
});

test("of what the API does not have nothing is taken", () => {
  const got: object | null = decode.status({ ...status(), more: 1, arm: { motion: "moving", packet_age_s: 1, constructor: 2 } });
  assert.ok(got && !("more" in got) && !Object.keys((got as { arm: object }).arm).includes("constructor"));
});
