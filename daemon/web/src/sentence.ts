// A status as a sentence: keys of the catalogue with values. Uses typed values only, no texts.

import { now_ms } from "./clock";
import type { Formats } from "./format";
import type { Key, Say } from "./words";
import type { FailureKind, Phase, Status } from "./types";

/** Motion of the arm; `free`: cellcal holds no link to it, without a failure. */
export type Motion = "moving" | "still" | "free" | "unknown";
export type Mood = "calm" | "busy" | "wait" | "good" | "bad" | "unknown";

const FREE: readonly Phase[] = ["idle", "planning", "connecting", "identifying", "reporting", "done"];
const OF_A_TOUCH: readonly Phase[] = [
  "transit", "arming fast", "fast search", "backing off", "arming slow", "slow search", "recording",
  "retreat",
];

const unconfirmed = (status: Status) => status.failure?.kind === "stop-unconfirmed";

/** Aborted, or without a plan, before a packet of the arm: nothing has been commanded. */
const never_linked = ({ phase, failure, arm }: Status) =>
  arm.packet_age_s === null && (phase === "aborted" || (phase === "failed" && failure?.kind === "plan"));

/** From the newest packet only: a phase describes the commanded, not the actual motion. */
export function motion(status: Status): Motion {
  if (unconfirmed(status)) return "unknown";
  switch (status.arm.motion) {
    case "moving": return "moving";
    case "at rest": return "still";
    default: return FREE.includes(status.phase) || never_linked(status) ? "free" : "unknown";
  }
}

/** With the age of that packet; empty where cellcal holds no link. `seen_s`: age of the status. */
export function motion_words(status: Status, seen_s: number, say: Say, fmt: Formats): string {
  const moves = motion(status);
  const { packet_age_s } = status.arm;
  if (moves === "free") return "";
  if (packet_age_s === null) return say("motion.never");
  const age_s = packet_age_s + seen_s;
  if (moves === "unknown")
    return say("motion.unknown", { since: fmt.clock(now_ms() - age_s * 1000), age: fmt.duration(age_s) });
  return say(`motion.${moves}`, { age: fmt.seconds(age_s) });
}

/** Whether something may move, for all that is known: a session runs, or the arm is not known to be at rest or free of cellcal. */
export const may_move = (status: Status): boolean => status.running || ["moving", "unknown"].includes(motion(status));

/** Advice on entering the cell; null: state not known. Never a release: that is the cell's own safety. */
export function near_words(status: Status | null, now_s: number, say: Say, fmt: Formats): string {
  if (!status) return say("near.unknown");
  const moves = motion(status);
  if (moves === "moving") return say("near.moving");
  if (status.running) return say("near.soon");
  if (moves === "unknown") return say("near.unknown");
  if (!status.schedule) return say("near.scheduled.unknown");
  const { open, next_utc_s: next_s } = status.schedule;
  // Due, though the newest status does not state it yet.
  if (open || (next_s !== null && next_s <= now_s)) return say("near.scheduled.now");
  return next_s === null ? say("near.free")
    : say("near.scheduled", { day: fmt.day(next_s), time: fmt.clock(next_s * 1000).slice(0, 5) });
}

export function mood(status: Status): Mood {
  switch (status.phase) {
    case "failed": return "bad";
    case "aborted": return "wait";
    case "done": return status.outcome?.good === false ? "wait" : "good";
    case "idle": return status.interrupted ? "wait" : "calm";
    case "connecting": case "recovering": case "watching the links": case "stopping": return "wait";
    case "unknown": return "unknown";
    default: return "busy";
  }
}

/** Number of the current touch, from 1. */
export function touch_in_hand(status: Status): number | null {
  if (!OF_A_TOUCH.includes(status.phase)) return null;
  return status.phase === "retreat" ? Math.max(1, status.touches) : status.touches + 1;
}

/** The status' target is that of the current touch, not of the one that the arm leaves. */
export const is_at_touch = (status: Status): boolean => status.phase !== "retreat" && touch_in_hand(status) !== null;

export function touch_words(status: Status, say: Say): string {
  if (status.finding && status.target) return say("touch.find", { target: status.target });
  const n = touch_in_hand(status) ?? status.touches + 1;
  if (!status.target || status.planned < n) return say("touch.some", { n });
  return say("touch.n", { n, total: status.planned, target: status.target });
}

/** `why`: of an abort; a person's has none. A dry run makes no touches. */
function ended(ending: "done" | "aborted" | "failed" | "interrupted" | "unknown", kind: string, why: FailureKind | null, planned: number): Key {
  if (kind === "dry-run" && ending !== "unknown") return `ended.${ending}`;
  if (ending === "aborted" && (why === "window-over" || why === "daemon-stopped")) return `phase.aborted.${why}`;
  return ending === "interrupted" ? left_after(planned) : `phase.${ending}`;
}

/** Of a session that another one goes on with; its touches may not have been planned yet. */
export const left_after = (planned: number): Key => (planned > 0 ? "resume.left" : "ended.interrupted");

export function sentence(status: Status, say: Say): string {
  const share = status.planning?.done ?? null;
  if (status.phase === "planning" && share !== null)
    return say("phase.planning.share", { percent: Math.round(100 * share) });
  const left = status.interrupted;
  if (status.phase === "idle" && left)
    return say(ended(left.ending, left.kind, left.failure, left.planned), { session: left.session, n: left.touches, total: left.planned });
  const key: Key = status.phase === "failed" && unconfirmed(status)
    ? "phase.failed.unconfirmed"
    : status.phase === "done" || status.phase === "aborted" || status.phase === "failed"
      ? ended(status.phase, status.kind, status.failure?.kind ?? null, status.planned)
      : `phase.${status.phase}`;
  return say(key, {
    session: status.session, n: status.touches, touch: touch_words(status, say),
  });
}

/** Unfinished newest session, also of an earlier run of the daemon, unless a new one follows it. */
export function resumable(status: Status): { session: number; n: number; total: number } | null {
  const { session, touches, planned, resumable } = status.interrupted ?? status;
  return resumable ? { session, n: touches, total: planned } : null;
}

/** How to go on after a session that failed, was aborted or interrupted. */
export const then_words = (status: Status, say: Say): string => say(resumable(status) ? "do.then.resume" : "do.then.anew");
