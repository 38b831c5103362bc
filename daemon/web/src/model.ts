// What the page knows, and how it becomes another by what arrives. Pure.

import type { RobotPosture, Status, Touch } from "./types";

export interface Model {
  /** login: the daemon answers, and says nothing without a token. */
  link: "connecting" | "answering" | "silent" | "login";
  /** When the newest status arrived [ms, the browser's own steady clock]. */
  seen: number | null;
  status: Status | null;
  /** Of the status' session, by number. */
  touches: Touch[];
  posture: RobotPosture | null;
  /** Why the daemon refuses to answer, in its words. */
  refusal: string;
}

export const EMPTY: Model = {
  link: "connecting", seen: null, status: null, touches: [], posture: null, refusal: "",
};

/** A status is asked for every 1.5 s. Older than this it must not be taken for what is. */
export const OLD_AFTER_MS = 4000;

/** How old what is shown is; 0 as long as it may be taken for what is. */
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

/** An answer to what was asked when `asked_at` was the newest. Events may have overtaken it; but one
 *  that is older than that is of a daemon that was started anew, and counts from 1 again. */
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
    // What came as it was made says more than what is read again later, before identification.
    kept.set(touch.index, {
      ...touch,
      residualMm: touch.residualMm ?? before?.residualMm ?? null,
      u95Mm: touch.u95Mm ?? before?.u95Mm ?? null,
    });
  }
  return { ...model, touches: [...kept.values()].sort((a, b) => a.index - b.index) };
}

/** Only while its session runs: later nobody knows where the arm is. */
export function with_posture(model: Model, posture: RobotPosture): Model {
  const { status } = model;
  if (!status?.running || status.session !== posture.session) return model;
  return { ...model, posture };
}

export const silent = (model: Model, refusal = ""): Model =>
  model.link === "login"
    ? model
    : { ...model, refusal, link: model.seen === null ? "connecting" : "silent" };
export const without_token = (): Model => ({ ...EMPTY, link: "login" });

/** Touches of the running session that did not come as events. */
export const lacks_touches = (model: Model): boolean =>
  model.status !== null && model.touches.length < model.status.touches;
