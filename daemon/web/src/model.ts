// State of the page and its transitions. Pure.

import type { RobotPosture, Status, Touch } from "./types";

export interface Model {
  /** login: the daemon answers, but requires a token. */
  link: "connecting" | "answering" | "silent" | "login";
  /** Arrival of the newest status [ms, monotonic clock of the browser]. */
  seen: number | null;
  status: Status | null;
  /** Of the status' session, by number. */
  touches: Touch[];
  /** Newest of the status' session, and its arrival. */
  posture: { at: RobotPosture; seen: number } | null;
  /** Reason of a refusal, as text of the daemon. */
  refusal: string;
}

export const EMPTY: Model = {
  link: "connecting", seen: null, status: null, touches: [], posture: null, refusal: "",
};

/** The status is polled every 1.5 s. Older values are not displayed as current. */
export const OLD_AFTER_MS = 4000;

/** Age of the displayed status; 0 while it counts as current. */
export function age_ms(model: Model, now: number): number {
  if (model.seen === null) return 0;
  const age = now - model.seen;
  return model.link === "answering" && age <= OLD_AFTER_MS ? 0 : Math.max(age, 1);
}

export function with_status(model: Model, status: Status, now: number): Model {
  const same = model.status?.session === status.session;
  const posture = same && status.running ? model.posture : null;
  return {
    ...model, link: "answering", refusal: "", seen: now, status, posture, touches: same ? model.touches : [],
  };
}

/** Applies the answer to a poll sent when `asked_at` was the newest. Events may have overtaken it; but an older answer comes from
 *  a restarted daemon, which counts from 1 again. */
export function answered(model: Model, status: Status, asked_at: number, now: number): Model {
  const newest = model.status?.seq ?? 0;
  const overtaken = status.seq >= asked_at && status.seq < newest;
  return overtaken ? { ...model, link: "answering", refusal: "", seen: now } : with_status(model, status, now);
}

export function with_touches(model: Model, touches: Touch[]): Model {
  const session = model.status?.session;
  const kept = new Map(model.touches.map((touch) => [touch.index, touch]));
  for (const touch of touches) {
    if (touch.session !== session) continue;
    const before = kept.get(touch.index);
    // The values published with the touch are more accurate than those reread before identification.
    kept.set(touch.index, {
      ...touch,
      residual_mm: touch.residual_mm ?? before?.residual_mm ?? null,
      u95_mm: touch.u95_mm ?? before?.u95_mm ?? null,
    });
  }
  return { ...model, touches: [...kept.values()].sort((a, b) => a.index - b.index) };
}

/** Only during its session: afterwards the arm's position is unknown. */
export function with_posture(model: Model, at: RobotPosture, seen: number): Model {
  const { status } = model;
  if (!status?.running || status.session !== at.session) return model;
  return { ...model, posture: { at, seen } };
}

/** Where the arm is now, as far as packets of the controller show it. */
export function measured_posture({ status, posture }: Model, now: number): RobotPosture | null {
  return posture && status && status.arm.motion !== "unknown" && now - posture.seen <= OLD_AFTER_MS ? posture.at : null;
}

export const silent = (model: Model, refusal = ""): Model =>
  model.link === "login"
    ? model
    : { ...model, refusal, link: model.seen === null ? "connecting" : "silent" };
export const without_token = (): Model => ({ ...EMPTY, link: "login" });

/** Touches of the running session that were not received as events. */
export const lacks_touches = (model: Model): boolean =>
  model.status !== null && model.touches.length < model.status.touches;
