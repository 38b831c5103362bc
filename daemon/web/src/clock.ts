// What time it is. This computer may have slept, and its clock may be wrong by an hour or a year; the daemon states its own with every
// answer.

/** Differences below are of the way, and of the full seconds that the daemon states. */
const SAME_MS = 2000;

let ahead_ms = 0;
let slept_ms = 0;
let [wall, steady] = [Date.now(), performance.now()];

/** `stated`: header "Date" of an answer of the daemon. */
export function heard(stated: string | null): void {
  const apart = Date.parse(stated ?? "") - Date.now();
  if (!Number.isNaN(apart)) ahead_ms = Math.abs(apart) > SAME_MS ? apart : 0;
}

/** Of the daemon [ms since 1970]. */
export const now_ms = (): number => Date.now() + ahead_ms;

/** For ages [ms]: like performance.now(), but goes on while the computer sleeps. */
export function ticks_ms(): number {
  const [wall_now, steady_now] = [Date.now(), performance.now()];
  const apart = wall_now - wall - (steady_now - steady);
  if (apart > SAME_MS) slept_ms += apart; // less is a clock that is corrected
  [wall, steady] = [wall_now, steady_now];
  return steady_now + slept_ms;
}
