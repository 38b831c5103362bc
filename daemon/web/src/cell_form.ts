// Cell form as typed and as sent to the daemon; pure. U is for k = 2, as in certificates; the daemon uses 1 sigma.

import { fields, known, list, number, truth, words } from "./decode";
import type { Answer } from "./request";
import type { Key } from "./words";

export type Place = "centre" | "taught" | "box";
export type Shape = "box" | "cylinder" | "mesh";
/** Certificate of a value, as stated by its row; empty: not stated. */
interface Vouched {
  certificate: string;
  date: string;
}
export interface SphereDraft extends Vouched {
  id: string;
  diameter: string;
  u: string;
  place: Place;
  where: string;
  rough: string;
  serial: string;
}
export interface LengthDraft extends Vouched {
  from: string;
  to: string;
  mm: string;
  u: string;
}
export interface ObstacleDraft {
  id: string;
  shape: Shape;
  /** Box: X Y Z; cylinder: diameter and height. */
  size: string;
  /** Mesh: STL file on the daemon's computer. */
  file: string;
  /** Middle; of a mesh its frame. */
  middle: string;
  turn: string;
}
/** Its own certificate and date are those shared by most rows: see `vouch`. */
export interface CellDraft extends Vouched {
  name: string;
  robot: string;
  xyz: string;
  abc: string;
  /** Of X Y Z, k = 2: one number, or three. */
  tool_u: string;
  mass: string;
  /** Empty: half-way to the TCP. */
  com: string;
  tip: string;
  /** Empty: not stated. */
  floor: string;
  spheres: SphereDraft[];
  lengths: LengthDraft[];
  obstacles: ObstacleDraft[];
}

const NOTHING: Vouched = { certificate: "", date: "" };
export const new_sphere = (n: number, { certificate, date }: Vouched = NOTHING): SphereDraft =>
  ({ id: `S${n}`, diameter: "", u: "", place: "centre", where: "", rough: "20", serial: "", certificate, date });
export const new_length = (from = "", to = "", { certificate, date }: Vouched = NOTHING): LengthDraft =>
  ({ from, to, mm: "", u: "", certificate, date });
export const EMPTY: CellDraft = {
  name: "cell", robot: "", xyz: "", abc: "0 0 0", tool_u: "1", mass: "", com: "", tip: "0", floor: "",
  spheres: [1, 2, 3, 4].map((n) => new_sphere(n)), lengths: [], obstacles: [], ...NOTHING,
};
export const new_obstacle = (n: number): ObstacleDraft =>
  ({ id: `obstacle ${n}`, shape: "box", size: "", file: "", middle: "", turn: "0 0 0" });

/** Applies an edit of the shared certificate to the rows that stated the same; rows with another certificate or none are
 *  unchanged. `before`: state at the begin of the edit, so that a temporarily empty field does not match rows without a
 *  certificate. */
export function vouch(draft: CellDraft, change: Partial<Vouched>, before: CellDraft = draft): CellDraft {
  const follow = <R extends Vouched>(rows: R[], were: Vouched[]): R[] => rows.map((row, i) =>
    were[i]?.certificate === before.certificate && were[i]?.date === before.date ? { ...row, ...change } : row);
  return { ...draft, ...change, spheres: follow(draft.spheres, before.spheres), lengths: follow(draft.lengths, before.lengths) };
}

/** Replaces rows by those of a CSV file. Where none states a certificate, that of the form applies. */
export function imported(draft: CellDraft, rows: { spheres: SphereDraft[] } | { lengths: LengthDraft[] }): CellDraft {
  const read: Vouched[] = "spheres" in rows ? rows.spheres : rows.lengths;
  const stated = read.find((one) => one.certificate !== "" || one.date !== "");
  const shared: Vouched = { certificate: draft.certificate, date: draft.date };
  const own = <R extends Vouched>(row: R): R => (stated ? row : { ...row, ...shared });
  const now: CellDraft = "spheres" in rows ? { ...draft, spheres: rows.spheres.map(own) } : { ...draft, lengths: rows.lengths.map(own) };
  return stated ? { ...now, certificate: stated.certificate, date: stated.date } : now;
}

/** Invalid content of a field. */
export interface Wrong {
  field: "robot" | "xyz" | "abc" | "tool_u" | "mass" | "com" | "tip" | "floor" | "diameter" | "u" | "where" | "rough" | "mm" | "size" | "file" | "middle" | "turn";
  /** Id of the sphere, distance or obstacle. */
  of: string;
  /** Permitted counts of numbers; empty: something has to be chosen. */
  counts: readonly number[];
  /** The numbers have to be above 0. */
  positive: boolean;
  /** Place in the form: "spheres.1.diameter". */
  at: string;
}

/** A value that the daemon refuses, with the daemon's reason. */
export interface Refused {
  at: string;
  /** Words of the page for the field's label. */
  label: Key;
  of: string;
  reason: string;
}

/** Keys of the form as sent, by field of the draft and its label. */
const SENT: Record<"tool" | "spheres" | "lengths" | "obstacles", Record<string, [field: string, label: Key]>> = {
  tool: {
    name: ["name", "cell.name"], robot: ["robot", "cell.robot"], xyz_mm: ["xyz", "cell.xyz"], abc_deg: ["abc", "cell.abc"], xyz_sigma_mm: ["tool_u", "cell.tool_u"],
    mass_kg: ["mass", "cell.mass"], com_mm: ["com", "cell.com"], tip_radius_mm: ["tip", "cell.tip"], floor_mm: ["floor", "cell.floor"],
  },
  spheres: {
    id: ["id", "cell.id"], diameter_mm: ["diameter", "cell.diameter"], diameter_sigma_mm: ["u", "cell.u"], centre_mm: ["where", "cell.where"],
    joints_deg: ["where", "cell.where"], box_mm: ["where", "cell.where"], centre_sigma_mm: ["rough", "cell.rough"], serial: ["serial", "cell.serial"],
    certificate: ["certificate", "cell.row.certificate"], certificate_date: ["date", "cell.row.date"],
  },
  lengths: {
    from: ["mm", "cell.mm"], to: ["mm", "cell.mm"], mm: ["mm", "cell.mm"], sigma_mm: ["u", "cell.u"],
    certificate: ["certificate", "cell.row.certificate"], certificate_date: ["date", "cell.row.date"],
  },
  obstacles: {
    id: ["id", "cell.id"], size_mm: ["size", "cell.size"], diameter_mm: ["size", "cell.size"], height_mm: ["size", "cell.size"], file: ["file", "cell.file"],
    xyz_mm: ["middle", "cell.middle"], abc_deg: ["turn", "cell.turn"],
  },
};

/** Field that a refusal of the daemon is about; null: of no single field. */
export function refused_field(value: unknown, draft: CellDraft): Refused | null {
  const all = fields(value);
  const parts = words(all?.key).split("."), reason = words(all?.reason);
  const [group = "", row = "", key = ""] = parts.length === 3 ? parts : ["tool", "", parts[parts.length - 1] ?? ""];
  const of_group = SENT[group as keyof typeof SENT];
  const found = of_group?.[key];
  if (!Array.isArray(found) || reason === "") return null; // no field has a name of every object's
  const [field, label] = found;
  if (group === "tool") return { at: `tool.${field}`, label, of: "", reason };
  const of = group === "spheres" ? draft.spheres[Number(row)]?.id : group === "obstacles" ? draft.obstacles[Number(row)]?.id
    : draft.lengths.slice(Number(row)).map(length_name)[0];
  return of === undefined ? null : { at: `${group}.${row}.${field}`, label, of, reason };
}

/** Numbers separated by spaces or semicolons, with '.' or ',' as decimal mark. Null: not all are numbers. */
export function numbers_in(text: string): number[] | null {
  const parts = text.trim().split(/[\s;]+/).filter((one) => one !== "");
  const values = parts.map((one) => (/^[+-]?\d+([.,]\d+)?$/.test(one) ? Number(one.replace(",", ".")) : NaN));
  return values.every((one) => Number.isFinite(one)) ? values : null;
}

class Reader {
  readonly wrong: Wrong[] = [];
  constructor(private at = "", private of = "") {}
  /** The same list, for the fields of a row. */
  row(at: string, of: string): this {
    this.at = at;
    this.of = of;
    return this;
  }
  refuse(field: Wrong["field"], counts: readonly number[] = [], positive = false): void {
    this.wrong.push({ field, of: this.of, counts, positive, at: `${this.at}.${field}` });
  }
  take(text: string, field: Wrong["field"], counts: readonly number[], positive = false): number[] {
    const values = numbers_in(text);
    if (values !== null && counts.includes(values.length) && (!positive || values.every((one) => one > 0))) return values;
    this.refuse(field, counts, positive);
    return new Array<number>(counts[0] ?? 0).fill(0);
  }
  one(text: string, field: Wrong["field"], positive = false): number {
    return this.take(text, field, [1], positive)[0] ?? 0;
  }
}

const AXES = [6, 7] as const;
const half = (u: number): number => Number((u / 2).toPrecision(12));
const three = (values: number[]): number[] => (values.length === 1 ? [0, 1, 2].map(() => values[0] ?? 0) : values);
const twice = (sigma: number): string => String(Number((sigma * 2).toPrecision(12)));

function place_of(sphere: SphereDraft, read: Reader): Record<string, unknown> {
  if (sphere.place === "taught") return { joints_deg: read.take(sphere.where, "where", AXES) };
  if (sphere.place === "centre") return { centre_mm: read.take(sphere.where, "where", [3]) };
  const six = read.take(sphere.where, "where", [6]);
  return { box_mm: [six.slice(0, 3), six.slice(3)] };
}

const vouched = ({ certificate, date }: Vouched): Record<string, string> => ({
  ...(certificate.trim() === "" ? {} : { certificate: certificate.trim() }),
  ...(date.trim() === "" ? {} : { certificate_date: date.trim() }),
});

function tool_form(draft: CellDraft, read: Reader): Record<string, unknown> {
  const tool: Record<string, unknown> = {
    xyz_mm: read.take(draft.xyz, "xyz", [3]),
    abc_deg: read.take(draft.abc, "abc", [3]),
    xyz_sigma_mm: three(read.take(draft.tool_u, "tool_u", [1, 3])).map(half),
    tip_radius_mm: read.one(draft.tip, "tip"),
  };
  if (draft.mass.trim() !== "") tool.mass_kg = read.one(draft.mass, "mass");
  if (draft.com.trim() !== "") tool.com_mm = read.take(draft.com, "com", [3]);
  return tool;
}

const floor_form = (floor: string, read: Reader): Record<string, unknown> => (floor.trim() === "" ? {} : { floor_mm: read.one(floor, "floor") });

const sphere_form = (sphere: SphereDraft, read: Reader): Record<string, unknown> => ({
  id: sphere.id.trim(),
  diameter_mm: read.one(sphere.diameter, "diameter", true),
  diameter_sigma_mm: half(read.one(sphere.u, "u")),
  ...place_of(sphere, read),
  ...(sphere.place === "box" ? {} : { centre_sigma_mm: half(read.one(sphere.rough, "rough")) }),
  ...(sphere.serial.trim() === "" ? {} : { serial: sphere.serial.trim() }),
  ...vouched(sphere),
});

const length_form = (length: LengthDraft, read: Reader): Record<string, unknown> => ({
  from: length.from.trim(), to: length.to.trim(),
  mm: read.one(length.mm, "mm", true), sigma_mm: half(read.one(length.u, "u", true)), ...vouched(length),
});

function extent_of({ shape, size, file }: ObstacleDraft, read: Reader): Record<string, unknown> {
  if (shape === "box") return { size_mm: read.take(size, "size", [3], true) };
  if (shape === "mesh") {
    if (file === "") read.refuse("file");
    return { file };
  }
  const [diameter_mm, height_mm] = read.take(size, "size", [2], true);
  return { diameter_mm, height_mm };
}

const obstacle_form = (obstacle: ObstacleDraft, read: Reader): Record<string, unknown> => ({
  id: obstacle.id.trim(), shape: obstacle.shape, ...extent_of(obstacle, read),
  xyz_mm: read.take(obstacle.middle, "middle", [3]), abc_deg: read.take(obstacle.turn, "turn", [3]),
});

const length_name = ({ from, to }: LengthDraft): string => `${from}–${to}`;

/** The `form` to send to the daemon, or all errors. */
export function form_of(draft: CellDraft): { form: unknown } | { wrong: Wrong[] } {
  const read = new Reader("tool");
  if (draft.robot === "") read.refuse("robot");
  const form = {
    robot: draft.robot, tool: tool_form(draft, read), ...floor_form(draft.floor, read),
    spheres: draft.spheres.map((one, i) => sphere_form(one, read.row(`spheres.${i}`, one.id))),
    lengths: draft.lengths.map((one, i) => length_form(one, read.row(`lengths.${i}`, length_name(one)))),
    obstacles: draft.obstacles.map((one, i) => obstacle_form(one, read.row(`obstacles.${i}`, one.id))),
  };
  return read.wrong.length > 0 ? { wrong: read.wrong } : { form };
}

/** Rows that are complete, one of each name. */
function complete<R extends { id: string }>(rows: R[], make: (row: R, read: Reader) => Record<string, unknown>): Record<string, unknown>[] {
  const seen = new Set<string>();
  return rows.flatMap((row) => {
    const read = new Reader();
    const made = make(row, read);
    const id = row.id.trim();
    if (read.wrong.length > 0 || id === "" || seen.has(id)) return [];
    seen.add(id);
    return [made];
  });
}

const stated = (text: string, counts: readonly number[], otherwise: string): string => {
  const values = numbers_in(text);
  return values !== null && counts.includes(values.length) ? text : otherwise;
};

/** As much of the form as can be drawn already; null without a robot. */
export function sketch_of(draft: CellDraft): unknown {
  if (draft.robot === "") return null;
  const tool = { ...draft, xyz: stated(draft.xyz, [3], "0 0 0"), abc: stated(draft.abc, [3], "0 0 0"), tool_u: "0", mass: "", com: "", tip: stated(draft.tip, [1], "0") };
  const spheres = draft.spheres.map((one) => ({ ...one, u: "0", rough: stated(one.rough, [1], "20"), serial: "", ...NOTHING }));
  const floor = floor_form(stated(draft.floor, [1], ""), new Reader());
  return { robot: draft.robot, tool: tool_form(tool, new Reader()), ...floor, spheres: complete(spheres, sphere_form), lengths: [], obstacles: complete(draft.obstacles, obstacle_form) };
}

/** What the daemon needs to propose places: all but the places; or what is missing. */
export function places_wanted(draft: CellDraft): { form: unknown } | { wrong: Wrong[] } {
  const at = "0 0 0";
  return form_of({ ...draft, spheres: draft.spheres.map((one) => ({ ...one, u: stated(one.u, [1], "0"), place: "centre", where: at, rough: "20" })) });
}

/** Spheres at the proposed places. */
export const placed = (draft: CellDraft, spheres: SphereDraft[]): SphereDraft[] => draft.spheres.map((one) => {
  const there = spheres.find((other) => other.id === one.id.trim());
  return there ? { ...one, place: "centre", where: there.where, rough: there.rough } : one;
});

const spaced = (value: unknown): string =>
  list(value).flat().map(number).filter((one): one is number => one !== null).join(" ");

/** A single number where all three are equal. */
function doubled(sigmas: unknown): string {
  const us = list(sigmas).map(number).filter((one): one is number => one !== null).map(twice);
  return us.length !== 3 ? "0" : us.every((one) => one === us[0]) ? us[0] ?? "0" : us.join(" ");
}

const vouched_by = (all: Record<string, unknown>): Vouched =>
  ({ certificate: words(all.certificate), date: words(all.certificate_date) });

function sphere_draft(value: unknown): SphereDraft | null {
  const all = fields(value);
  if (!all) return null;
  const boxed = Array.isArray(all.box_mm);
  return {
    id: words(all.id), diameter: String(number(all.diameter_mm) ?? ""), u: twice(number(all.diameter_sigma_mm) ?? 0.002),
    place: boxed ? "box" : "centre", where: spaced(boxed ? all.box_mm : all.centre_mm),
    rough: twice(number(all.centre_sigma_mm) ?? 10), serial: words(all.serial),
    ...vouched_by(all),
  };
}
function length_draft(value: unknown): LengthDraft | null {
  const all = fields(value);
  return all && {
    from: words(all.from), to: words(all.to), mm: String(number(all.mm) ?? ""), u: twice(number(all.sigma_mm) ?? 0),
    ...vouched_by(all),
  };
}
function obstacle_draft(value: unknown): ObstacleDraft | null {
  const all = fields(value);
  const shape = SHAPES.find((one) => one === all?.shape);
  if (!all || !shape) return null;
  const size = shape === "box" ? all.size_mm : shape === "cylinder" ? [all.diameter_mm, all.height_mm] : [];
  return { id: words(all.id), shape, size: spaced(size), file: words(all.file), middle: spaced(all.xyz_mm), turn: spaced(all.abc_deg) || "0 0 0" };
}
export const sphere_drafts = (value: unknown): SphereDraft[] => known(list(value).map(sphere_draft));
export const SHAPES: readonly Shape[] = ["box", "cylinder", "mesh"];
export const length_drafts = (value: unknown): LengthDraft[] => known(list(value).map(length_draft));

/** Certificate of the first row that states one. */
const shared_by = (rows: Vouched[]): Vouched => {
  const { certificate, date } = rows.find((one) => one.certificate !== "" || one.date !== "") ?? NOTHING;
  return { certificate, date };
};

export function draft_of(name: string, value: unknown): CellDraft | null {
  const form = fields(value);
  const tool = fields(form?.tool);
  if (!form || !tool) return null;
  const spheres = sphere_drafts(form.spheres), lengths = length_drafts(form.lengths);
  return {
    name, robot: words(form.robot), xyz: spaced(tool.xyz_mm), abc: spaced(tool.abc_deg) || "0 0 0", tool_u: doubled(tool.xyz_sigma_mm),
    mass: tool.mass_kg === undefined ? "" : String(number(tool.mass_kg) ?? ""), com: spaced(tool.com_mm), tip: String(number(tool.tip_radius_mm) ?? 0),
    floor: String(number(form.floor_mm) ?? ""),
    spheres, lengths, obstacles: known(list(form.obstacles).map(obstacle_draft)), ...shared_by([...spheres, ...lengths]),
  };
}

export interface RobotChoice {
  /** Shipped robot, or path of a robot file. */
  name: string;
  model: string;
}
export function robot_choice(value: unknown): RobotChoice | null {
  const robot = fields(value);
  return robot && { name: words(robot.name), model: words(robot.model) };
}

/** The linear unit that carries an imported robot. */
export interface UnitSeen {
  /** Empty: it is described. */
  missing: string;
  name: string;
  along: number[];
  min: number;
  max: number;
  /** mm/s; null: not stated. */
  speed: number | null;
}
/** Of the answer to an imported robot; null: nothing carries the arm. */
export function unit_seen(value: unknown): UnitSeen | null {
  const unit = fields(fields(value)?.linear_unit);
  if (!unit) return null;
  const along = known(list(unit.along).map(number));
  const min = number(unit.min_mm), max = number(unit.max_mm);
  const missing = words(unit.missing);
  if (missing === "" && (along.length !== 3 || min === null || max === null)) return null;
  return { missing, name: words(unit.name), along, min: min ?? 0, max: max ?? 0, speed: number(unit.max_speed_mm_s) };
}

export interface CellForms {
  folder: string;
  /** The controller reports the arm's position outside of sessions. */
  readsPosition: boolean;
  robots: RobotChoice[];
  shown: { file: string; sha256: string; kept: string[]; draft: CellDraft | null } | null;
}
export function cell_forms(value: unknown): CellForms | null {
  const all = fields(value);
  if (!all) return null;
  const shown = fields(all.shown);
  return {
    folder: words(all.folder), readsPosition: truth(all.reads_position) === true,
    robots: known(list(all.robots).map(robot_choice)),
    shown: shown && { file: words(shown.file), sha256: words(shown.sha256), kept: list(shown.kept).map(words), draft: draft_of(words(shown.name), shown.form) },
  };
}

const NOT_FOUND = 404, UNUSABLE = 422;
/** Which of both fills the form: that of the cell, or, only where there is none that can be shown, `empty`. */
export const form_answer = (empty: Answer, of_cell: Answer): Answer => ([NOT_FOUND, UNUSABLE].includes(of_cell.status) ? empty : of_cell);

/** A file that a cell file names and that is not here. */
export interface MissingFile {
  name: string;
  /** Id of the obstacle; null: the robot. */
  of: string | null;
}
/** Those that are not chosen yet. */
export const still_missing = (files: MissingFile[], { robot, obstacles }: CellDraft): MissingFile[] =>
  files.filter(({ of }) => (of === null ? robot === "" : obstacles.some(({ id, shape, file }) => id === of && shape === "mesh" && file === "")));

/** A cell file of another computer, as a form. */
export interface CellFileSeen {
  draft: CellDraft;
  kept: string[];
  missing: MissingFile[];
}
export function cell_file(name: string, value: unknown): CellFileSeen | null {
  const all = fields(value);
  const draft = draft_of(name.replace(/\.toml$/i, "").replace(/[^A-Za-z0-9_-]/g, "_").slice(0, 64) || "cell", all?.form);
  if (!all || !draft) return null;
  // In the daemon's order: the robot, then the meshes.
  const without = [...(draft.robot === "" ? [null] : []), ...draft.obstacles.filter((one) => one.shape === "mesh").map((one) => one.id)];
  return { draft, kept: list(all.kept).map(words), missing: list(all.missing).map((name, i) => ({ name: words(name), of: without[i] ?? null })) };
}

/** Axis angles in the format of a taught sphere; null: none were read. */
export function taught_angles(value: unknown): string | null {
  const axes = list(fields(value)?.axes_deg).map((one) => number(one)).slice(0, Math.max(...AXES));
  const whole = axes.length >= Math.min(...AXES) && axes.every((one) => one !== null);
  return whole ? axes.map((one) => (one as number).toFixed(4).replace(/\.?0+$/, "")).join(" ") : null;
}

/** Name of a file created here; empty for any other file. */
export function name_within(folder: string, file: string): string {
  const rest = folder !== "" && file.startsWith(`${folder}/`) ? file.slice(folder.length + 1) : "";
  return /^[A-Za-z0-9_-]+\.toml$/.test(rest) ? rest.slice(0, -".toml".length) : "";
}
