import assert from "node:assert/strict";
import { test } from "node:test";
import { EventReader } from "../src/sse";

const all = (...texts: string[]) => {
  const reader = new EventReader();
  return texts.flatMap((text) => reader.take(text));
};

test("an event is taken wherever the stream is cut", () => {
  const text = "event: status\nid: 57\ndata: {\"seq\":57}\n\n";
  for (let cut = 0; cut <= text.length; ++cut) {
    assert.deepEqual(all(text.slice(0, cut), text.slice(cut)), [{ name: "status", data: "{\"seq\":57}", id: "57" }], `cut at ${cut}`);
  }
});

test("line ends of all three kinds end a line once, cut or not", () => {
  for (const end of ["\n", "\r\n", "\r"]) {
    const text = `event: a${end}data: 1${end}data: 2${end}${end}event: b${end}data: 3${end}${end}\n`;
    for (let cut = 0; cut <= text.length; ++cut) {
      const events = all(text.slice(0, cut), text.slice(cut));
      assert.deepEqual(events.map((event) => event.name + event.data), ["a1\n2", "b3"], `${JSON.stringify(end)} cut at ${cut}`);
    }
  }
});

test("comments are signs of life and nothing else", () => {
  assert.deepEqual(all(":\n\n", ": still here\n\n"), []);
});

test("an event without a number keeps the one before it", () => {
  const events = all("id: 4.1\ndata: x\n\n", "event: robot\ndata: y\n\n");
  assert.deepEqual(events.map((event) => event.id), ["4.1", "4.1"]);
});

test("a number with a zero byte is none", () => {
  assert.equal(all("id: 4\u0000\ndata: x\n\n")[0]?.id, "");
});

test("what is too long is dropped, and what follows it is taken", () => {
  const endless = "data: " + "x".repeat(3_000_000);
  const events = all(endless, "yyy\n\n", "data: 1\n\n");
  assert.deepEqual(events.map((event) => event.data), ["1"]);
  const many = Array.from({ length: 3000 }, () => "data: " + "z".repeat(1000) + "\n").join("");
  assert.deepEqual(all(many, "\n", "data: 2\n\n").map((event) => event.data), ["2"]);
});

test("an event that was cut off at the end never comes", () => {
  assert.deepEqual(all("event: status\ndata: {\"seq\":1}\n"), []);
});
