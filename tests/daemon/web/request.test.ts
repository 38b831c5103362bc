import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";
import { asking, is_unanswered, refusal, type Answer } from "../src/request";
import { login_refusal } from "../src/ui/login";
import { speaker } from "../src/words";

const answer = (status: number): Answer => ({ status, value: null, words: "" });
const now = { setTimeout: globalThis.setTimeout, clearTimeout: globalThis.clearTimeout };
/** Timers that the test lets expire. */
let due: { run: () => void; ms: number }[] = [];
const expire = async () => {
  const [one] = due.splice(0, 1);
  one?.run();
  await new Promise((done) => now.setTimeout(done, 0));
  return one?.ms;
};

beforeEach(() => {
  due = [];
  globalThis.setTimeout = ((run: () => void, ms: number) => {
    const one = { run, ms };
    due.push(one);
    return one;
  }) as unknown as typeof setTimeout;
  globalThis.clearTimeout = ((one: unknown) => { due = due.filter((other) => other !== one); }) as typeof clearTimeout;
});
afterEach(() => Object.assign(globalThis, now));

/** Asks a daemon that answers with these states, one after the other; returns what was received. */
function ask_of(states: number[], again: (status: number) => number | undefined = () => undefined, wait_ms = 0) {
  const seen: number[] = [];
  const end = asking(async () => answer(states.shift() ?? 200), ({ status }) => {
    seen.push(status);
    return again(status);
  }, wait_ms);
  return { seen, end };
}

test("a daemon that does not answer is asked until it does", async () => {
  const { seen } = ask_of([0, 0, 0, 0, 0, 0, 0, 404]);
  for (let k = 0; k < 10; ++k) await expire();
  assert.deepEqual(seen, [0, 0, 0, 0, 0, 0, 0, 404]);
  assert.equal(due.length, 0);
});

test("a busy daemon is asked until it answers, after a few times more slowly", async () => {
  const { seen } = ask_of([...Array<number>(20).fill(503), 200]);
  await expire();
  const waited: (number | undefined)[] = [];
  for (let k = 0; k < 20; ++k) waited.push(await expire());
  assert.deepEqual(waited, [...Array<number>(4).fill(2000), ...Array<number>(16).fill(10_000)]);
  assert.equal(seen.at(-1), 200);
  assert.equal(due.length, 0);
});

test("what was known stays where the daemon says nothing of it", () => {
  assert.deepEqual([0, 503, 200, 404, 401].map((status) => is_unanswered(answer(status))), [true, true, false, false, false]);
});

test("what goes on is asked for again at its own pace", async () => {
  const { seen } = ask_of([200, 200, 201], (status) => (status === 200 ? 1000 : undefined));
  await expire();
  for (let k = 0; k < 2; ++k) assert.equal(await expire(), 1000);
  assert.deepEqual(seen, [200, 200, 201]);
  assert.equal(due.length, 0);
});

test("a token is not valid only where the daemon says so", () => {
  const say = speaker("en");
  const told = (status: number, words = "") => login_refusal({ ...answer(status), words }, say);
  assert.match(told(401, "no token or an invalid one"), /^This token is not valid/);
  assert.equal(told(503, "too many requests"), "too many requests");
  assert.equal(told(403), "cellcald refused (HTTP 403).");
  assert.match(told(0), /^No answer from cellcald/);
  assert.equal(refusal({ ...answer(401), words: "a token is needed" }, speaker("de")), "Abgemeldet. Anmelden, dann noch einmal versuchen.");
});

test("an answer is not received after the end, and a request that waits is not sent", async () => {
  const late = ask_of([0, 200]);
  late.end();
  await expire();
  assert.deepEqual(late.seen, []);
  const waiting = ask_of([200], undefined, 400);
  assert.equal(due[0]?.ms, 400);
  waiting.end();
  assert.equal(due.length, 0);
});
