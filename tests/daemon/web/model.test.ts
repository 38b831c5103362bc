import assert from "node:assert/strict";
import { test } from "node:test";
import * as decode from "../src/decode";
import { formats } from "../src/format";
import { EMPTY, OLD_AFTER_MS, answered, age_ms, lacks_touches, measured_posture, silent, with_posture, with_status, with_touches, without_token } from "../src/model";
import { mood, motion, motion_words, resumable, sentence, then_words } from "../src/sentence";
import * as api from "../generated/api";
import type { RobotLink } from "../src/types";
import { robot_is_good } from "../src/ui/links";
import { speaker } from "../src/words";
import { status, words_of } from "./kr5";

const PHASES = words_of(api.Phase), FAILURES = words_of(api.FailureKind);
const of = (more: Record<string, unknown> = {}) => decode.status(status(more))!;
const touch = (index: number, residual: number | null = null, session = 3) =>
  decode.touch({ session, index, target: "S1", set: "fit", joints_deg: [1], tip_mm: [0, 0, 0], residual_mm: residual, u95_mm: null })!;

test("a running session is shown as such only as long as the daemon answers", () => {
  const running = with_status(EMPTY, of(), 1000);
  assert.equal(age_ms(running, 1000), 0);
  assert.equal(age_ms(running, 1000 + OLD_AFTER_MS), 0);
  assert.ok(age_ms(running, 1001 + OLD_AFTER_MS) > OLD_AFTER_MS);
  assert.ok(age_ms(silent(running), 1000) > 0, "an answer that failed counts at once");
  assert.equal(age_ms(with_status(silent(running), of(), 9000), 9000), 0);
});

test("an answer that events have overtaken changes nothing, and one of a new daemon everything", () => {
  const now_at = with_status(EMPTY, of({ seq: 60, phase: "fast search" }), 0);
  const overtaken = answered(now_at, of({ seq: 5, phase: "planning" }), 4, 10);
  assert.equal(overtaken.status?.phase, "fast search");
  assert.equal(overtaken.seen, 10);
  assert.equal(answered(now_at, of({ seq: 5, phase: "planning" }), 60, 10).status?.phase, "planning");
  assert.equal(answered(now_at, of({ seq: 60, phase: "transit" }), 60, 10).status?.phase, "transit", "links move on");
});

test("joints are shown while their own session runs and not after it", () => {
  const running = with_status(EMPTY, of(), 0);
  const at = { session: 3, joints_deg: [1, 2, 3], positioner_deg: [] };
  assert.deepEqual(with_posture(running, at, 5).posture, { at, seen: 5 });
  assert.equal(with_posture(running, { ...at, session: 2 }, 5).posture, null);
  const ended = with_status(with_posture(running, at, 5), of({ running: false, phase: "aborted" }), 6);
  assert.equal(ended.posture, null);
  assert.equal(with_posture(ended, at, 7).posture, null);
});

test("the arm is where packets show it only while they come", () => {
  const at = { session: 3, joints_deg: [1, 2, 3], positioner_deg: [] };
  const model = with_posture(with_status(EMPTY, of(), 0), at, 1000);
  assert.equal(measured_posture(model, 1000 + OLD_AFTER_MS), at);
  assert.equal(measured_posture(model, 1001 + OLD_AFTER_MS), null, "events stopped, while the status comes");
  for (const arm of [{ motion: "unknown", packet_age_s: 2 }, { motion: "unknown", packet_age_s: null }, undefined])
    assert.equal(measured_posture(with_status(model, of({ arm }), 1000), 1000), null);
  assert.equal(measured_posture(with_status(model, of({ arm: { motion: "at rest", packet_age_s: 0 } }), 1000), 1000), at);
  assert.equal(measured_posture(EMPTY, 0), null);
});

test("touches come in any order, once each, and keep the residual that they were made with", () => {
  let model = with_status(EMPTY, of(), 0);
  model = with_touches(model, [touch(1, 0.2), touch(0, 0.1)]);
  model = with_touches(model, [touch(1), touch(2, 0.3), touch(9, 1, 2)]);
  assert.deepEqual(model.touches.map((one) => [one.index, one.residual_mm]), [[0, 0.1], [1, 0.2], [2, 0.3]]);
  assert.ok(lacks_touches(model));
});

test("another session begins without the touches of the one before", () => {
  const model = with_touches(with_status(EMPTY, of(), 0), [touch(0)]);
  assert.equal(with_status(model, of({ session: 4, touches: 0 }), 1).touches.length, 0);
});

test("without a token nothing of the cell is kept", () => {
  const model = without_token();
  assert.equal(model.status, null);
  assert.equal(silent(model).link, "login");
  assert.equal(silent(EMPTY, "Host is not known").refusal, "Host is not known");
});

test("every phase and every failure has a sentence of its own", () => {
  const say = speaker("en");
  const sentences = PHASES.map((phase) => sentence(of({ phase }), say));
  assert.ok(sentences.every((words) => words.length > 5 && !/[{}]|undefined/.test(words)));
  assert.equal(new Set(FAILURES.map((kind) => say(`failure.${kind}`))).size, FAILURES.length);
});

test("a plan that is made says how far it is, where that is known", () => {
  const planning = of({ phase: "planning", planning: { step: "choose", done: 0.404 } });
  assert.match(sentence(planning, speaker("en")), /40 %/);
  assert.match(sentence(planning, speaker("de")), /40 %/);
  assert.doesNotMatch(sentence(of({ phase: "planning", planning: null }), speaker("en")), /%/);
});

test("a stop without confirmation is never called a standstill", () => {
  const failed = of({ phase: "failed", running: false, failure: { kind: "stop-unconfirmed", detail: "" } });
  assert.equal(motion(failed), "unknown");
  assert.match(sentence(failed, speaker("en")), /STOP NOT CONFIRMED/);
  assert.doesNotMatch(sentence(failed, speaker("en")), /at rest/);
  assert.equal(motion(of({ phase: "levitating", arm: undefined })), "unknown");
});

test("the arm is at rest only as far as the newest packet of the controller shows it", () => {
  const say = speaker("en"), fmt = formats("en");
  const failed = (arm: unknown) => of({ phase: "failed", running: false, failure: { kind: "robot-silent", detail: "" }, arm });
  const fresh = failed({ motion: "at rest", packet_age_s: 0.1 });
  assert.match(motion_words(fresh, 0, say, fmt), /^Arm at rest \(packet 0\.1\u00a0s old\)$/);
  const gone = failed({ motion: "unknown", packet_age_s: 11 });
  assert.equal(motion(gone), "unknown");
  assert.match(motion_words(gone, 1, say, fmt), /^Arm: unknown since \d\d:\d\d:\d\d, newest packet 12\u00a0s old/);
  assert.equal(motion(of({ arm: undefined })), "unknown", "of a daemon that says nothing of it");
  const never = { motion: "unknown", packet_age_s: null };
  assert.match(motion_words(failed(never), 0, say, fmt), /no packet/);
  assert.equal(motion(of({ phase: "aborted", running: false, arm: never })), "free", "before a link was opened");
  assert.equal(motion(of({ phase: "aborted", running: false, arm: { ...never, packet_age_s: 3 } })), "unknown");
  for (const phase of PHASES)
    for (const language of ["en", "de"] as const)
      assert.doesNotMatch(sentence(of({ phase }), speaker(language)), /at rest|steht still/, phase);
});

test("a robot's link is good only with enough packets for their cycle, and never with a lack", () => {
  const robot = (more: object): RobotLink => ({ packets: 15, late: 0, gaps: 0, bad_packets: 0, cycle_ms: 4, ...more }) as RobotLink;
  assert.equal(robot_is_good(robot({}), ""), true);
  assert.equal(robot_is_good(robot({ cycle_ms: 0 }), ""), null);
  for (const lack of [{ late: 1 }, { gaps: 1 }, { bad_packets: 1 }]) assert.equal(robot_is_good(robot({ cycle_ms: 0, ...lack }), ""), false);
  assert.equal(robot_is_good(robot({ cycle_ms: 0 }), "no packet for 5 s"), false);
});

test("what can be gone on with is what was left, failed or aborted", () => {
  assert.equal(resumable(of({ phase: "idle", session: 0, resumable: false })), null);
  assert.equal(resumable(of({ phase: "aborted", resumable: true }))?.session, 3);
  const left = { session: 2, touches: 5, planned: 9, started: "", ending: "interrupted", anew: "", resumable: true };
  const idle = (interrupted: object) => of({ phase: "idle", session: 0, resumable: false, interrupted });
  assert.deepEqual(resumable(idle(left)), { session: 2, n: 5, total: 9 });
  assert.equal(resumable(idle({ ...left, resumable: false })), null);
  assert.notEqual(then_words(idle(left), speaker("en")), then_words(idle({ ...left, resumable: false }), speaker("en")));
});

test("a session that an earlier run of the daemon left is the page's sentence, and not calm", () => {
  const left = { session: 2, touches: 5, planned: 9, started: "", anew: "" };
  const idle = (ending: string) => of({ phase: "idle", session: 0, running: false, interrupted: { ...left, ending } });
  const sentences = ["interrupted", "aborted", "failed"].map((ending) => sentence(idle(ending), speaker("en")));
  assert.deepEqual(sentences, ["Session 2 was interrupted after 5 of 9 touches.", "Session 2 was aborted after 5 touches.", "Session 2 failed after 5 touches."]);
  assert.equal(mood(idle("interrupted")), "wait");
  const unplanned = of({ phase: "idle", session: 0, running: false, interrupted: { ...left, touches: 0, planned: 0, ending: "interrupted" } });
  assert.equal(sentence(unplanned, speaker("en")), "Session 2 was interrupted.", "its touches were not planned yet");
});

test("a session that the schedule or the end of the daemon stopped is not called aborted, also after a restart", () => {
  for (const [kind, told] of [["window-over", /stopped at the end of its window, after/], ["daemon-stopped", /ended after \d+ touches: cellcald was stopped/]] as const) {
    assert.match(sentence(of({ phase: "aborted", running: false, failure: { kind, detail: "" } }), speaker("en")), told);
    const left = { session: 2, touches: 5, planned: 9, started: "", anew: "", ending: "aborted", failure: kind, kind: "calibrate" };
    assert.match(sentence(of({ phase: "idle", session: 0, running: false, interrupted: left }), speaker("en")), told);
  }
  assert.match(sentence(of({ phase: "aborted", running: false, failure: null }), speaker("en")), /was aborted after/);
});

test("a dry run, which makes no touches, has none in its sentence", () => {
  for (const language of ["en", "de"] as const)
    for (const ending of ["interrupted", "aborted", "failed", "done"]) {
      const left = { session: 2, touches: 0, planned: 9, started: "", anew: "cellcal dry-run", kind: "dry-run", failure: null, ending };
      const words = [of({ phase: ending, kind: "dry-run", running: false, touches: 8 })];
      if (ending !== "done") words.push(of({ phase: "idle", session: 0, running: false, interrupted: left }));
      for (const status of ending === "interrupted" ? words.slice(1) : words)
        assert.match(sentence(status, speaker(language)), /^(Session|Sitzung) [23] [a-zA-Z ]+\.$/, ending);
    }
});
