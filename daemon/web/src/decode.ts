// Answers and events as typed values, read by the API's own description (read.ts, api.mjs); here is what that cannot say.
// Never throws. Null where the whole value is unusable.

import * as api from "../generated/api";
import { fields, list, read, read_all } from "./read";
import type { Figures, Proposal, ProposalsSeen, RobotPosture, Role, Scene, Solid, Touch } from "./types";

export { fields, list } from "./read";

const MOST_DRAWN = 4_000_000;

export function parse(text: string): unknown {
  try {
    return JSON.parse(text);
  } catch {
    return null;
  }
}

export const number = (value: unknown) => read<number>({ type: "number" }, value);
export const truth = (value: unknown) => read<boolean>({ type: "boolean" }, value);
export const words = (value: unknown): string => read<string>({ type: "string" }, value) ?? "";
export const known = <T>(items: (T | null)[]): T[] => items.filter((one): one is T => one !== null);

export const status = (value: unknown) => read(api.Status, value);
export const touch = (value: unknown): Touch | null => read(api.TouchEvent, value);
export const plan = (value: unknown) => read(api.Plan, value)?.touches ?? [];
export const sessions = (value: unknown) => read_all(api.SessionLine, value);
export const versions = (value: unknown) => read_all(api.Version, value);
export const readiness = (value: unknown) => read(api.Readiness, value);
export const doctor = (value: unknown) => read(api.Doctor, value);
/** Without a role the daemon reports nothing about the cell. */
export const role = (value: unknown): Role | null => read(api.Me, value)?.role ?? null;
export const error_words = (value: unknown): string => words(fields(value)?.error);

const is_shown = (one: api.Proposal): one is Proposal => one.kind !== "withdraw" && one.stand !== "withdrawn";
export function proposals(value: unknown): ProposalsSeen | null {
  const all = read(api.Proposals, value);
  return all && { ...all, proposals: all.proposals.filter(is_shown) };
}

/** Of different nominal arms or tools there is no distance. */
export function comparison(value: unknown): api.Comparison | null {
  const all = read(api.Comparison, value);
  return all && { ...all, mean_mm: all.comparable ? all.mean_mm : null };
}

export function posture(value: unknown): RobotPosture | null {
  const at = read(api.RobotEvent, value);
  return at && at.joints_deg.length > 0 ? at : null;
}

function is_drawable(shape: api.Shape): shape is Solid {
  const corners = shape.vertices_mm.length / 3;
  return shape.shape === "cylinder" || (shape.shape === "box" && shape.size_mm !== null) ||
    (shape.shape === "mesh" && shape.triangles.length > 0 && shape.triangles.every((one) => one < corners));
}

export function scene(value: unknown): Scene | null {
  const all = read(api.Scene, value);
  // A positioner is whole or there is none; without one of its axes nothing on it can be placed.
  return all && list(fields(value)?.positioner).length === all.positioner.length
    ? { ...all, up: all.up ?? [0, 0, 1], stands: all.stands.filter(is_drawable), obstacles: all.obstacles.filter(is_drawable) } : null;
}

export function figures(value: unknown): Figures | null {
  const all = read(api.Figures, value);
  return all && { ...all, touches: all.touches.map((one) => ({ ...one, session: all.session })) };
}

/** A limit of zero would make every share infinite. */
const are_limits = (limits: api.ControlLimits) => limits.ewma > 0 && limits.cusum > 0;
export function drift(value: unknown): api.Drift {
  const { checks, ...all } = read(api.Drift, value) ?? { cell: "", sessions: [], checks: null, controller: null };
  return { ...all, checks: checks && are_limits(checks.warns) && are_limits(checks.alarms) ? checks : null };
}

/** A drawing cut off would be none. */
const drawing = (value: unknown): string => (typeof value === "string" && value.length <= MOST_DRAWN ? value : "");
export function plots(value: unknown): api.Plots | null {
  const all = fields(value);
  return all && { session: number(all.session) ?? 0, before_after: drawing(all.before_after),
                  by_joint: list(all.by_joint).map(drawing).filter((one) => one !== ""), error_map: drawing(all.error_map) };
}
