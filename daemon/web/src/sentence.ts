// A status as a sentence: keys of the catalogue with their values. Typed values in, no words read.

import type { Key, Say } from "./words";
import type { Phase, Status } from "./types";

/** What the arm does; `free`: cellcal holds no link to it. */
export type Motion = "moving" | "still" | "free" | "unknown";
export type Mood = "calm" | "busy" | "wait" | "good" | "bad" | "unknown";

const MOVING: readonly Phase[] = [
  "freeing", "transit", "fast search", "backing off", "slow search", "retreat", "returning",
  "stopping",
];
const STILL: readonly Phase[] = [
  "referencing", "routing", "proving", "arming fast", "arming slow", "recording", "choosing",
  "recovering", "watching the links", "aborted", "failed",
];
const FREE: readonly Phase[] = ["idle", "planning", "connecting", "identifying", "reporting", "done"];
const OF_A_TOUCH: readonly Phase[] = [
  "transit", "arming fast", "fast search", "backing off", "arming slow", "slow search", "recording",
  "retreat",
];

const unconfirmed = (status: Status) => status.failure?.kind === "stop-unconfirmed";

export function motion(status: Status): Motion {
  if (unconfirmed(status)) return "unknown";
  if (MOVING.includes(status.phase)) return "moving";
  if (STILL.includes(status.phase)) return "still";
  return FREE.includes(status.phase) ? "free" : "unknown";
}

export function mood(status: Status): Mood {
  switch (status.phase) {
    case "failed": return "bad";
    case "aborted": return "wait";
    case "done": return status.publish === false ? "wait" : "good";
    case "idle": return "calm";
    case "connecting": case "recovering": case "watching the links": case "stopping": return "wait";
    case "unknown": return "unknown";
    default: return "busy";
  }
}

/** Number of the touch in hand, from 1. */
export function touch_in_hand(status: Status): number | null {
  if (!OF_A_TOUCH.includes(status.phase)) return null;
  return status.phase === "retreat" ? Math.max(1, status.touches) : status.touches + 1;
}

export function touch_words(status: Status, say: Say): string {
  if (status.finding && status.target) return say("touch.find", { target: status.target });
  const n = touch_in_hand(status) ?? status.touches + 1;
  if (!status.target || status.planned < n) return say("touch.some", { n });
  return say("touch.n", { n, total: status.planned, target: status.target });
}

export function sentence(status: Status, say: Say): string {
  const key: Key = status.phase === "failed" && unconfirmed(status)
    ? "phase.failed.unconfirmed"
    : `phase.${status.phase}`;
  return say(key, {
    session: status.session, n: status.touches, touch: touch_words(status, say),
  });
}

/** Idle with a session that a killed daemon left, failed or aborted: it can be gone on with. */
export function resumable(status: Status): { session: number; n: number; total: number } | null {
  if (status.interrupted) {
    const { session, touches, planned } = status.interrupted;
    return { session, n: touches, total: planned };
  }
  const ended = status.phase === "failed" || status.phase === "aborted";
  return ended && status.session > 0
    ? { session: status.session, n: status.touches, total: status.planned }
    : null;
}
