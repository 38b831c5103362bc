import assert from "node:assert/strict";
import { test } from "node:test";
import * as decode from "../src/decode";
import { carried, inverse, origin, place, posture, times, upright } from "../src/kinematics";
import { kr5 } from "./kr5";

const scene = decode.scene(kr5());
assert.ok(scene);

const near = (got: readonly number[] | undefined, wanted: readonly number[]) =>
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

/** E1 tilts about the y axis through (1000, 0, 500), E2 turns about the vertical through (1000, 0, 600). */
const beside = decode.scene({
  ...kr5(),
  positioner: [
    { name: "E1", sign: 1, frame: [1, 0, 0, 1000, 0, 0, 1, 0, 0, -1, 0, 500] },
    { name: "E2", sign: -1, frame: [1, 0, 0, 1000, 0, 1, 0, 0, 0, 0, 1, 600] },
  ],
  targets: [{ id: "T1", kind: "sphere", diameter_mm: 40, centre_mm: [1100, 0, 600], box_mm: null, on: "E2" }],
});

test("what a positioner carries turns with the axes up to its own", () => {
  assert.ok(beside);
  assert.equal(beside.targets[0]?.on, "E2");
  const at: [number, number, number] = [1100, 0, 600];
  near(place(carried(beside, "E2", [0, 90]), at), [1000, -100, 600]); // in the negative sense of z
  near(place(carried(beside, "E1", [90, 90]), at), [1100, 0, 400]);
  near(place(carried(beside, "E2", [90, 90]), at), [1100, -100, 500]);
  near(place(carried(beside, "", [90, 90]), at), at);
  near(place(carried(beside, "E2", []), at), at);
  const moved = carried(beside, "E2", [35, -70]);
  near(times(inverse(moved), moved), [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]);
});

test("upright turns the base frame so that up is z", () => {
  near(upright([0, 0, 1]), [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]);
  near(place(upright([0, 0, -1]), [100, 200, 1100]), [100, -200, -1100]); // hung: x stays
  near(place(upright([1, 0, 0]), [100, 0, 300]), [300, 0, 100]); // on a wall: z is horizontal
  near(place(upright([0.6, 0, 0.8]), [6, 0, 8]), [0, 0, 10]);
});
