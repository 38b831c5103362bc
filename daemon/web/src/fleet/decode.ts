// Answers of the collector, read as in ../decode.ts by the collector's description (daemon/fleet/openapi.json).

import * as api from "../../generated/api";
import { fields, list, words } from "../decode";
import { read } from "../read";

export const cells = (value: unknown) => read(api.FleetCells, value)?.cells ?? null;
export const cell_seen = (value: unknown) => read(api.FleetCellSeen, value);
export const corrections = (value: unknown) => read(api.Corrections, value)?.corrections ?? null;

/** Null while another joint's or model's are known only. */
export const of_asked = (seen: { asked: string | null; all: api.Correction[] } | null, asked: string | null): api.Correction[] | null =>
  seen && seen.asked === asked ? seen.all : null;
/** Differs once a cell has another calibration. */
export const calibrations_in_use = (cells: api.FleetCell[]): string =>
  cells.map((one) => `${one.plant}/${one.cell} ${one.journal} ${one.calibration} ${one.calibrated_at}`).join();

/** Of the workspace, else near the targets. */
export const predicted_mm = (one: { over_mm: number | null; near_mm: number | null }) => one.over_mm ?? one.near_mm;

/** An update that finds nothing changed withholds nothing. */
export const verdict = (one: { published: boolean; findings: string[] }) =>
  one.published ? "fleet.published" : one.findings.includes("update_not_needed") ? "history.nothing_changed" : "fleet.withheld";

/** A file cut off would be none. */
export const certificate_files = (value: unknown): { name: string; base64: string }[] =>
  list(fields(value)?.files).flatMap((one) => {
    const file = fields(one);
    const name = words(file?.name);
    return file && name !== "" && typeof file.base64 === "string" && file.base64.length % 4 === 0 && /^[A-Za-z0-9+/]*={0,2}$/.test(file.base64)
      ? [{ name, base64: file.base64 }] : [];
  });
