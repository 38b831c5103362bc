// GET /v1/scene of the KR 5 R1400 with a straight tool of 100 mm, for the tests.

import type { Rule } from "../src/read";

const behind = (a: number, d: number, alpha: number) => {
  const c = Math.round(Math.cos((alpha * Math.PI) / 180)), s = Math.round(Math.sin((alpha * Math.PI) / 180));
  return [1, 0, 0, a, 0, c, -s, 0, 0, s, c, d];
};
const joint = (name: string, sign: number, offset: number, d: number, a: number, alpha: number) => ({
  name, along: null as number[] | null, sign, offset_deg: offset, min_deg: -180, max_deg: 180, behind: behind(a, d, alpha), radius_mm: 100,
});
/** Values defined by the API. */
export const words_of = <T>({ words }: Rule<T>) => words as readonly Exclude<T, "nothing">[];

const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];

export const kr5 = () => ({
  session: 3, robot: "KR 5", base: IDENTITY, flange: IDENTITY,
  joints: [
    joint("A1", -1, 0, 400, 180, -90), joint("A2", 1, 0, 0, 600, 0), joint("A3", 1, -90, 0, 40, -90),
    joint("A4", -1, 0, 620, 0, 90), joint("A5", 1, 180, 0, 0, 90), joint("A6", -1, 0, 80, 0, 0),
  ],
  tool: { frame: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 100], radius_mm: 30, tip_length_mm: 60, tip_radius_mm: 4 },
  targets: [{ id: "S1", kind: "sphere", diameter_mm: 61.4, centre_mm: [1080, -320, 330], box_mm: null }],
  stands: [], obstacles: [], up: [0, 0, 1], floor_mm: null,
});

export const status = (more: Record<string, unknown> = {}) => ({
  seq: 7, session: 3, kind: "calibrate", phase: "transit", running: true, target: "S1", touches: 4, planned: 10,
  residual_mm: 0.5, goal_mm: null, u95_mm: null, finding: false, time_left_s: 90, arm: { motion: "moving", packet_age_s: 0.1 }, waiting: null,
  warnings: [], interruptions: 0, busyRepeats: 0, busyLeftS: null, outcome: null, reasons: [], links: null, interrupted: null, failure: null,
  version: "1", ...more,
});
