// What may move the arm: what is sent when, and what a person's word still counts for.

import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";
import { begin, CLEAR_FOR_MS, counts, situation, type Start } from "../src/clearance";
import * as decode from "../src/decode";
import { EMPTY, OLD_AFTER_MS, silent, with_status } from "../src/model";
import { speaker } from "../src/words";
import { status } from "./kr5";

const say = speaker("en");
const fetched = globalThis.fetch;
/** Requests that the daemon has not answered yet. */
let sent: { path: string; answer: (status: number, body?: object) => void; lose: () => void }[] = [];

beforeEach(() => {
  sent = [];
  globalThis.fetch = ((path: string) => new Promise((done, lost) => {
    sent.push({ path, answer: (status, body = {}) => done(new Response(JSON.stringify(body), { status })), lose: () => lost(new Error()) });
  })) as typeof fetch;
});
afterEach(() => { globalThis.fetch = fetched; });

const settled = () => new Promise((done) => setTimeout(done, 0));
const paths = () => sent.map((one) => one.path);
function starting() {
  const start: Start = { called_off: false, sent: false };
  const out: string[][] = [];
  return { start, out, end: begin(start, { touches: 8 }, say, () => out.push(paths())) };
}

test("a session starts by the word that the cell is clear, then by the request", async () => {
  const { start, out, end } = starting();
  assert.deepEqual([paths(), start.sent], [["/v1/clear"], false]);
  sent[0]!.answer(200);
  await settled();
  assert.deepEqual([paths(), start.sent], [["/v1/clear", "/v1/run"], true]);
  assert.deepEqual(out, [["/v1/clear"]], "it is said before it is sent");
  sent[1]!.answer(201);
  assert.equal((await end).words, "");
  assert.equal(start.sent, false);
});

test("a start that is called off before its request is out is not sent", async () => {
  for (const status of [200, 409, 503]) {
    sent = [];
    const { start, out, end } = starting();
    start.called_off = true;
    sent[0]!.answer(status);
    assert.match((await end).words, /^Called off: /);
    assert.deepEqual([paths(), out, start.sent], [["/v1/clear"], [], false]);
  }
});

test("of a start that is refused or without an answer it is said", async () => {
  const unclear = starting();
  sent[0]!.answer(409, { error: "a session is in progress" });
  assert.deepEqual(await unclear.end, { words: "a session is in progress", lang: "en" });
  assert.deepEqual(paths(), ["/v1/clear"]);
  sent = [];
  const { start, end } = starting();
  sent[0]!.answer(200);
  await settled();
  sent[1]!.answer(422, { error: "no such file" });
  assert.deepEqual(await end, { words: "no such file", lang: "en" }, "the daemon's words");
  assert.equal(start.sent, false);
  sent = [];
  const lost = starting();
  sent[0]!.answer(200);
  await settled();
  sent[1]!.lose();
  const { words, lang } = await lost.end;
  assert.match(words, /^Start sent: the arm can move .* ABORT/, "it may have begun");
  assert.equal(lang, undefined, "the page's own");
});

test("the word that the cell is clear counts for one session, one phase, five minutes, and while the daemon answers", () => {
  const of = (more: object) => with_status(EMPTY, decode.status(status({ running: false, phase: "done", arm: undefined, ...more }))!, 0);
  const at = situation(of({}), 0), given = { situation: at, given_ms: 1e12 };
  const later = (ms: number, now = at) => counts(given, now, 1e12 + ms);
  assert.ok(later(0));
  assert.ok(later(CLEAR_FOR_MS - 1));
  for (const ms of [CLEAR_FOR_MS, 8 * 3600_000, -1]) assert.ok(!later(ms), `${ms} ms`);
  assert.ok(later(1, situation(of({ seq: 9, warnings: ["x"] }), OLD_AFTER_MS)), "news of the same");
  const others = [situation(of({ session: 4 }), 0), situation(of({ phase: "failed" }), 0), situation(of({ running: true, phase: "planning" }), 0),
    situation(silent(of({})), 0), situation(of({}), OLD_AFTER_MS + 1), situation(EMPTY, 0)];
  for (const other of others) assert.ok(!later(1, other), other);
});
