// Requests to the daemon. They never throw and have a time limit.

import { heard } from "./clock";
import { error_words, parse } from "./decode";
import type { Say } from "./words";

export interface Answer {
  /** 0: no answer. */
  status: number;
  value: unknown;
  /** Error message of the daemon. */
  words: string;
}

const LONGEST_MS = 15_000;

export async function request(
  method: "GET" | "POST", path: string, body?: unknown, longest_ms = LONGEST_MS,
): Promise<Answer> {
  const limit = new AbortController();
  const timer = setTimeout(() => limit.abort(), longest_ms);
  try {
    const answer = await fetch(path, {
      method, signal: limit.signal, cache: "no-store",
      headers: body === undefined ? {} : { "Content-Type": body instanceof Blob ? "application/octet-stream" : "application/json" },
      body: body === undefined ? null : body instanceof Blob ? body : JSON.stringify(body),
    });
    heard(answer.headers.get("Date"));
    const value = parse(await answer.text());
    return { status: answer.status, value, words: answer.ok ? "" : error_words(value) };
  } catch {
    return { status: 0, value: null, words: "" };
  } finally {
    clearTimeout(timer);
  }
}

export const get = (path: string, longest_ms?: number) =>
  request("GET", path, undefined, longest_ms);
export const post = (path: string, body: unknown = {}, longest_ms?: number) => request("POST", path, body, longest_ms);
export const post_file = (path: string, file: Blob, longest_ms: number) => request("POST", path, file, longest_ms);
export const is_good = (answer: Answer): boolean => answer.status >= 200 && answer.status < 300;

export const SILENT = 0, NO_TOKEN = 401;
const BUSY = 503;
/** Why it was refused, in the daemon's words where it has some. */
export const refusal = ({ status, words }: Answer, say: Say): string =>
  status === SILENT ? say("request.no-answer") : status === NO_TOKEN ? say("login.first") : words || say("request.refused", { status });

/** `lang`: of the daemon's words, which are in English. */
export interface Refusal {
  words: string;
  lang?: "en";
}
export const NOT_REFUSED: Refusal = { words: "" };
export const refused_by = (answer: Answer, say: Say): Refusal => {
  const words = refusal(answer, say);
  return words === answer.words ? { words, lang: "en" } : { words };
};

const TRIES = 5, AGAIN_MS = 2000, SLOWLY_MS = 10_000;
/** It says nothing of what was asked for: asked again, and what was known before stays. */
export const is_unanswered = ({ status }: Answer): boolean => status === SILENT || status === BUSY;

/**
 * Asks at once or after `wait_ms`, and again while the daemon does not answer or is busy, after a few times more slowly. `answered`
 * receives every answer, and returns the milliseconds after which to ask again anyway. The returned function ends it: nothing is
 * received after.
 */
export function asking(ask: () => Promise<Answer>, answered: (answer: Answer) => number | undefined | void, wait_ms = 0): () => void {
  let over = false, busy = 0, timer: ReturnType<typeof setTimeout> | undefined;
  const once = async () => {
    const answer = await ask();
    if (over) return;
    const again_ms = answered(answer);
    if (answer.status === BUSY) ++busy;
    const unanswered_ms = busy < TRIES ? AGAIN_MS : SLOWLY_MS;
    if (again_ms !== undefined || is_unanswered(answer)) timer = setTimeout(() => void once(), again_ms ?? unanswered_ms);
  };
  if (wait_ms > 0) timer = setTimeout(() => void once(), wait_ms);
  else void once();
  return () => {
    over = true;
    clearTimeout(timer);
  };
}
