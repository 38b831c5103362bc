// Validation of the collector's answers against types.ts; as in ../decode.ts, nothing is trusted.

import { count, fields, known, list, number, one_of, words } from "../decode";
import {
  NEEDS, type CellSeen, type CertificateFile, type Correction, type FleetCalibration, type FleetCell, type FleetCheck, type FleetSession,
  type Need,
} from "./types";

const HELD = ["yes", "no", "undecided"] as const;

function need(value: unknown): Need | null {
  const all = fields(value);
  return all ? { what: one_of(all.what, NEEDS), since: words(all.since), detail: words(all.detail) } : null;
}
function cell(value: unknown): FleetCell | null {
  const all = fields(value);
  if (!all || words(all.plant) === "" || words(all.cell) === "") return null;
  return {
    plant: words(all.plant), cell: words(all.cell), online: typeof all.online === "boolean" ? all.online : null,
    mock: all.mock === true, robot: words(all.robot), robotSerial: words(all.robot_serial), state: words(all.state),
    calibration: number(all.calibration), calibratedAt: words(all.calibrated_at),
    predictedMm: number(all.over_mm) ?? number(all.near_mm), held: HELD.find((one) => one === all.held) ?? null,
    shiftMm: number(all.shift_mm), checkedAt: words(all.checked_at), needs: known(list(all.needs).map(need)),
  };
}
export function cells(value: unknown): FleetCell[] | null {
  const all = fields(value);
  return all && Array.isArray(all.cells) ? known(list(all.cells).map(cell)) : null;
}

function calibration(value: unknown): FleetCalibration | null {
  const all = fields(value);
  if (!all || number(all.session) === null) return null;
  return {
    journal: words(all.journal), session: count(all.session), at: words(all.at), published: all.published === true,
    update: all.is_update === true, predictedMm: number(all.over_mm) ?? number(all.near_mm), certificate: all.certificate === true,
  };
}
function check(value: unknown): FleetCheck | null {
  const all = fields(value);
  const held = HELD.find((one) => one === all?.held);
  if (!all || !held) return null;
  return {
    journal: words(all.journal), session: count(all.session), at: words(all.at), against: count(all.against), held,
    shiftMm: number(all.shift_mm), uMm: number(all.u_mm),
  };
}
function session(value: unknown): FleetSession | null {
  const all = fields(value);
  if (!all || number(all.session) === null) return null;
  return {
    session: count(all.session), at: words(all.at), state: words(all.state), touches: count(all.touches), planned: count(all.planned),
    failure: words(all.failure),
  };
}
export function cell_seen(value: unknown): CellSeen | null {
  const all = fields(value);
  if (!all) return null;
  return {
    calibrations: known(list(all.calibrations).map(calibration)), checks: known(list(all.checks).map(check)),
    sessions: known(list(all.sessions).map(session)),
    gaps: known(list(all.gaps).map((one) => {
      const gap = fields(one);
      return gap ? { first: count(gap.first), last: count(gap.last), settled: gap.settled === true } : null;
    })),
    refused: known(list(all.refused).map((one) => {
      const refusal = fields(one);
      return refusal ? { why: words(refusal.why), count: count(refusal.count) } : null;
    })),
  };
}

export function corrections(value: unknown): Correction[] | null {
  const all = fields(value);
  if (!all || !Array.isArray(all.corrections)) return null;
  return known(list(all.corrections).map((one): Correction | null => {
    const row = fields(one);
    const correction = number(row?.correction);
    if (!row || correction === null) return null;
    return {
      plant: words(row.plant), cell: words(row.cell), robotSerial: words(row.robot_serial), parameter: words(row.parameter),
      unit: words(row.unit), correction, sigma: number(row.sigma) ?? 0,
    };
  }));
}

export const certificate_files = (value: unknown): CertificateFile[] =>
  known(list(fields(value)?.files).map((one) => {
    const file = fields(one);
    const name = words(file?.name);
    return file && name !== "" && typeof file.base64 === "string" && file.base64.length % 4 === 0 && /^[A-Za-z0-9+/]*={0,2}$/.test(file.base64)
      ? { name, base64: file.base64 } : null;
  }));
