// Time of the daemon: the clock of this computer may be wrong by an hour or a year; the daemon states its own with every answer.

/** Differences below are of the way, and of the full seconds that the daemon states. */
const SAME_MS = 2000;

let ahead_ms = 0;

/** `stated`: header "Date" of an answer of the daemon. */
export function heard(stated: string | null): void {
  const apart = Date.parse(stated ?? "") - Date.now();
  if (!Number.isNaN(apart)) ahead_ms = Math.abs(apart) > SAME_MS ? apart : 0;
}

/** Of the daemon [ms since 1970]. */
export const now_ms = (): number => Date.now() + ahead_ms;
