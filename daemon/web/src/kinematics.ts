// Nominal arm: frames of all bodies at given joint angles. Frames are 3x4, row-major, mm.

import type { Frame, Point, Scene } from "./types";

const IDENTITY: Frame = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];

const at = (frame: Frame, row: number, column: number): number => frame[4 * row + column] ?? 0;

export function times(a: Frame, b: Frame): Frame {
  const product: number[] = [];
  for (let row = 0; row < 3; ++row)
    for (let column = 0; column < 4; ++column) {
      let sum = column === 3 ? at(a, row, 3) : 0;
      for (let k = 0; k < 3; ++k) sum += at(a, row, k) * at(b, k, column);
      product.push(sum);
    }
  return product;
}

export function turned_about_z(degrees: number): Frame {
  const angle = (degrees * Math.PI) / 180;
  const c = Math.cos(angle), s = Math.sin(angle);
  return [c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0];
}

export function shifted_along([x, y, z]: Point, mm: number): Frame {
  return [1, 0, 0, mm * x, 0, 1, 0, mm * y, 0, 0, 1, mm * z];
}

export const origin = (frame: Frame): Point => [at(frame, 0, 3), at(frame, 1, 3), at(frame, 2, 3)];

export function place(frame: Frame, [x, y, z]: Point): Point {
  const row = (k: number) => at(frame, k, 0) * x + at(frame, k, 1) * y + at(frame, k, 2) * z + at(frame, k, 3);
  return [row(0), row(1), row(2)];
}

/** The turn of the base frame after which `up` is z, and its x, on a wall its z, the horizontal that faces the viewer. */
export function upright(up: Point): Frame {
  const [x, y, z] = unit(up);
  const [a, b, c] = unit(Math.abs(x) < 0.7 ? [0, z, -y] : [y, -x, 0]); // up x (1, 0, 0), on a wall up x (0, 0, 1)
  return [b * z - c * y, c * x - a * z, a * y - b * x, 0, a, b, c, 0, x, y, z, 0];
}

function unit([x, y, z]: Point): Point {
  const length = Math.hypot(x, y, z);
  return [x / length, y / length, z / length];
}

/** What axes up to that named `on` have turned since 0, at `degrees` of each; of those not stated 0. */
export function carried(scene: Scene, on: string, degrees: number[]): Frame {
  let moved = IDENTITY;
  const axes = scene.positioner.findIndex((one) => one.name === on) + 1;
  scene.positioner.slice(0, axes).forEach((axis, i) => {
    const turned = times(axis.frame, turned_about_z(axis.sign * (degrees[i] ?? 0)));
    moved = times(moved, times(turned, inverse(axis.frame)));
  });
  return moved;
}

export function inverse(frame: Frame): Frame {
  const row = (k: number) => [at(frame, 0, k), at(frame, 1, k), at(frame, 2, k)] as Point;
  const [x, y, z] = origin(frame);
  return [0, 1, 2].flatMap((k) => {
    const [a, b, c] = row(k);
    return [a, b, c, -(a * x + b * y + c * z)];
  });
}

export interface Posture {
  /** Frames before and after each joint's fixed part; the last is after the last joint. Of a linear unit its
   * carriage's. */
  joints: { turned: Frame; behind: Frame }[];
  flange: Frame;
  tip: Frame;
}

/** `positions`: degrees, of a linear unit mm. Null where their number differs from the robot's. */
export function posture(scene: Scene, positions: number[]): Posture | null {
  if (positions.length !== scene.joints.length) return null;
  let frame = times(IDENTITY, scene.base);
  const joints = scene.joints.map((joint, i) => {
    const at = positions[i] ?? 0;
    const moved = joint.along ? shifted_along(joint.along, at) : turned_about_z(joint.sign * at + (joint.offset_deg ?? 0));
    const turned = times(frame, moved);
    frame = times(turned, joint.behind);
    return { turned, behind: frame };
  });
  const flange = times(frame, scene.flange);
  return { joints, flange, tip: times(flange, scene.tool.frame) };
}
