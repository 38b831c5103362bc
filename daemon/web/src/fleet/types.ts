// Data of the plant's collector on its cells (daemon/fleet/judge).

/** Worst first, as the collector sorts. */
export const NEEDS = ["interrupted", "failed", "drifted", "check-not-held", "offline", "gap", "withheld", "overdue"] as const;
export type NeedKind = (typeof NEEDS)[number] | "unknown";
export interface Need {
  what: NeedKind;
  since: string;
  detail: string;
}
export interface FleetCell {
  plant: string;
  cell: string;
  online: boolean | null;
  mock: boolean;
  robot: string;
  robotSerial: string;
  state: string;
  calibration: number | null;
  calibratedAt: string;
  predictedMm: number | null;
  held: "yes" | "no" | "undecided" | null;
  shiftMm: number | null;
  checkedAt: string;
  needs: Need[];
}
export interface FleetCalibration {
  journal: string;
  session: number;
  at: string;
  published: boolean;
  update: boolean;
  predictedMm: number | null;
  certificate: boolean;
}
export interface FleetCheck {
  journal: string;
  session: number;
  at: string;
  against: number;
  held: "yes" | "no" | "undecided";
  shiftMm: number | null;
  uMm: number | null;
}
export interface FleetSession {
  session: number;
  at: string;
  state: string;
  touches: number;
  planned: number;
  failure: string;
}
export interface CellSeen {
  calibrations: FleetCalibration[];
  checks: FleetCheck[];
  sessions: FleetSession[];
  gaps: { first: number; last: number; settled: boolean }[];
  refused: { why: string; count: number }[];
}
export interface Correction {
  plant: string;
  cell: string;
  robotSerial: string;
  parameter: string;
  unit: string;
  correction: number;
  sigma: number;
}
export interface CertificateFile {
  name: string;
  base64: string;
}
