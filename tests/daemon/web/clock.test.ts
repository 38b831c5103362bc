import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";
import { heard, now_ms } from "../src/clock";

const MINUTE_MS = 60_000, HOUR_MS = 3_600_000, YEAR_MS = 365 * 24 * HOUR_MS;
const before = { date: Date.now, performance: performance.now };
let wall = 1_800_000_000_000, steady = 1000;
const pass = (ms: number) => {
  wall += ms;
  steady += ms;
};

beforeEach(() => {
  Date.now = () => wall;
  performance.now = () => steady;
});
afterEach(() => {
  Date.now = before.date;
  performance.now = before.performance;
});

test("the time is the daemon's where this computer's clock is wrong", () => {
  for (const wrong of [-YEAR_MS, -HOUR_MS, HOUR_MS, YEAR_MS]) {
    heard(new Date(wall - wrong).toUTCString());
    pass(MINUTE_MS);
    assert.ok(Math.abs(now_ms() - (wall - wrong)) < 1000, `${wrong}`);
  }
  for (const stated of [null, "", "soon"]) heard(stated);
  assert.ok(Math.abs(now_ms() - (wall - YEAR_MS)) < 1000, "what states no time corrects nothing");
  heard(new Date(wall - 900).toUTCString());
  assert.equal(now_ms(), wall, "of full seconds");
});
