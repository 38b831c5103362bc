import assert from "node:assert/strict";
import { test } from "node:test";
import * as decode from "../src/decode";
import { origin, posture } from "../src/kinematics";
import { kr5 } from "./kr5";

const scene = decode.scene(kr5());
assert.ok(scene);

const near = (got: number[] | undefined, wanted: number[]) =>
  wanted.forEach((value, i) => assert.ok(Math.abs((got?.[i] ?? NaN) - value) < 1e-6, `${got} is not ${wanted}`));

test("the flange is where the pendant has it in the robot file's two postures", () => {
  near(posture(scene, [0, -90, 90, 0, 0, 0]) ? origin(posture(scene, [0, -90, 90, 0, 0, 0])!.flange) : undefined, [880, 0, 1040]);
  near(origin(posture(scene, [0, -90, 90, 0, 90, 0])!.flange), [800, 0, 960]);
});

test("the tool goes on from the flange, and A1 turns against the Denavit-Hartenberg sense", () => {
  near(origin(posture(scene, [0, -90, 90, 0, 0, 0])!.tip), [980, 0, 1040]);
  near(origin(posture(scene, [90, -90, 90, 0, 0, 0])!.tip), [0, -980, 1040]);
});

test("angles of another robot place nothing", () => {
  assert.equal(posture(scene, [0, 0]), null);
  assert.equal(posture(scene, []), null);
});

test("a linear unit carries the arm by millimetres along its direction", () => {
  const on_track = kr5();
  on_track.joints.unshift({
    ...on_track.joints[0]!, name: "E1", along: [0, 1, 0], behind: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0],
  });
  const carried = decode.scene(on_track);
  assert.ok(carried);
  near(origin(posture(carried, [1500, 0, -90, 90, 0, 0, 0])!.flange), [880, 1500, 1040]);
  assert.equal(posture(carried, [0, -90, 90, 0, 0, 0]), null);
});
