// A start that moves the arm: the word that the cell is clear, then the request, unless it is called off in between.

import { is_good, post, refusal, SILENT } from "./request";
import type { Say } from "./words";

/** A start on its way. */
export interface Start {
  called_off: boolean;
  /** From here on only an abort stops it. */
  sent: boolean;
}

/** Sends the confirmation, then the request, before which `sending` is called; returns why it did not begin, otherwise empty. */
export async function begin(start: Start, body: unknown, say: Say, sending: () => void): Promise<string> {
  const clear = await post("/v1/clear");
  if (start.called_off) return say("start.called_off");
  if (!is_good(clear)) return refusal(clear, say);
  start.sent = true;
  sending();
  const run = await post("/v1/run", body);
  start.sent = false;
  // Without an answer it may have begun all the same.
  return is_good(run) ? "" : run.status === SILENT ? say("start.sent") : refusal(run, say);
}
