import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";
import { Live } from "../src/live";
import { status } from "./kr5";

const before = { fetch: globalThis.fetch, setTimeout: globalThis.setTimeout, clearTimeout: globalThis.clearTimeout };
const settled = () => new Promise((done) => before.setTimeout(done, 5));
/** Timers that the test lets expire. */
let due: { run: () => void; ms: number }[] = [];
const expire = async (ms: number) => {
  const found = due.filter((one) => one.ms === ms);
  due = due.filter((one) => one.ms !== ms);
  for (const one of found) one.run();
  await settled();
  return found.length;
};

/** Requests of the event stream, and how the test answers them. */
let streams: { last: string | null; signal: AbortSignal; open: () => void; send: (text: string) => void }[] = [];

beforeEach(() => {
  [due, streams] = [[], []];
  globalThis.setTimeout = ((run: () => void, ms: number) => {
    const one = { run, ms };
    due.push(one);
    return one;
  }) as unknown as typeof setTimeout;
  globalThis.clearTimeout = ((one: unknown) => { due = due.filter((other) => other !== one); }) as typeof clearTimeout;
  globalThis.fetch = ((path: string, { signal, headers }: { signal: AbortSignal; headers: Record<string, string> }) => new Promise((done, lost) => {
    signal.addEventListener("abort", () => lost(new Error("aborted")));
    if (!path.startsWith("/v1/events")) return; // the daemon says nothing else
    let send = (_: string) => {};
    const body = new ReadableStream({
      start: (stream) => {
        send = (text) => stream.enqueue(new TextEncoder().encode(text));
        signal.addEventListener("abort", () => stream.error(new Error("aborted")));
      },
    });
    streams.push({ last: headers["Last-Event-ID"] ?? null, signal, open: () => done(new Response(body)), send: (text) => send(text) });
  })) as typeof fetch;
});
afterEach(() => Object.assign(globalThis, before));

const SILENCE_MS = 12_000, AGAIN_MS = 1500;

test("a stream of events that is silent is opened again, after the newest event", async () => {
  const live = new Live(() => {});
  live.begin();
  streams[0]!.open();
  await settled();
  streams[0]!.send(`event: status\nid: 7\ndata: ${JSON.stringify(status())}\n\n`);
  await settled();
  assert.equal(live.model.status?.seq, 7);
  for (let k = 0; k < 3; ++k) {
    const [before] = due.filter((one) => one.ms === SILENCE_MS);
    streams[0]!.send(":\n\n");
    await settled();
    const waiting = due.filter((one) => one.ms === SILENCE_MS);
    assert.equal(waiting.length, 1);
    assert.notEqual(waiting[0], before, "a comment is a sign of life");
  }
  assert.equal(streams[0]!.signal.aborted, false);
  assert.equal(await expire(SILENCE_MS), 1);
  assert.equal(streams[0]!.signal.aborted, true);
  await expire(AGAIN_MS);
  assert.deepEqual(streams.map((one) => one.last), [null, "7"]);
});

test("a stream that is never opened is asked for again", async () => {
  new Live(() => {}).begin();
  assert.equal(await expire(SILENCE_MS), 1);
  assert.equal(streams[0]!.signal.aborted, true);
  await expire(AGAIN_MS);
  assert.equal(streams.length, 2);
});
