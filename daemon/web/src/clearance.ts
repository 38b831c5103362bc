// A start that moves the arm: the word that the cell is clear, then the request, unless it is called off in between.

import { age_ms, type Model } from "./model";
import { is_good, NOT_REFUSED, post, refused_by, SILENT, type Refusal } from "./request";
import type { Say } from "./words";

/** A person's word that the cell is clear. */
export interface Clearance {
  situation: string;
  /** [ms since 1970], which goes on while the computer sleeps. */
  given_ms: number;
}

/** As the daemon's own (daemon/api/access.h). */
export const CLEAR_FOR_MS = 300_000;

/** What such a word is given for: after another session, in another phase and without the daemon it counts no longer. */
export const situation = (model: Model, now: number): string =>
  `${model.status?.session} ${model.status?.phase} ${model.seen === null || age_ms(model, now) > 0}`;

export const counts = (given: Clearance, situation: string, now_ms: number): boolean =>
  given.situation === situation && given.given_ms <= now_ms && now_ms < given.given_ms + CLEAR_FOR_MS;

/** A start on its way. */
export interface Start {
  called_off: boolean;
  /** From here on only an abort stops it. */
  sent: boolean;
}

/** Sends the confirmation, then the request, before which `sending` is called; returns why it did not begin. */
export async function begin(start: Start, body: unknown, say: Say, sending: () => void): Promise<Refusal> {
  const clear = await post("/v1/clear");
  if (start.called_off) return { words: say("start.called_off") };
  if (!is_good(clear)) return refused_by(clear, say);
  start.sent = true;
  sending();
  const run = await post("/v1/run", body);
  start.sent = false;
  // Without an answer it may have begun all the same.
  return is_good(run) ? NOT_REFUSED : run.status === SILENT ? { words: say("start.sent") } : refused_by(run, say);
}
