// Cell form as typed and as sent to the daemon; pure. U is for k = 2, as in certificates; the daemon uses 1 sigma.

import { fields, known, list, number, truth, words } from "./decode";

export type Place = "centre" | "taught" | "box";
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
/** Its own certificate and date are those shared by most rows: see `vouch`. */
export interface CellDraft extends Vouched {
  name: string;
  robot: string;
  xyz: string;
  abc: string;
  /** Of X Y Z, k = 2: one number, or three. */
  tool_u: string;
  mass: string;
  tip: string;
  spheres: SphereDraft[];
  lengths: LengthDraft[];
}

const NOTHING: Vouched = { certificate: "", date: "" };
export const new_sphere = (n: number, { certificate, date }: Vouched = NOTHING): SphereDraft =>
  ({ id: `S${n}`, diameter: "", u: "", place: "centre", where: "", rough: "20", serial: "", certificate, date });
export const new_length = (from = "", to = "", { certificate, date }: Vouched = NOTHING): LengthDraft =>
  ({ from, to, mm: "", u: "", certificate, date });
export const EMPTY: CellDraft = {
  name: "cell", robot: "", xyz: "", abc: "0 0 0", tool_u: "1", mass: "", tip: "0",
  spheres: [1, 2, 3, 4].map((n) => new_sphere(n)), lengths: [], ...NOTHING,
};

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
  field: "robot" | "xyz" | "abc" | "tool_u" | "mass" | "tip" | "diameter" | "u" | "where" | "rough" | "mm";
  /** Id of the sphere or distance. */
  of: string;
  /** Permitted counts of numbers. */
  counts: readonly number[];
}

/** Numbers separated by spaces or semicolons, with '.' or ',' as decimal mark. Null: not all are numbers. */
export function numbers_in(text: string): number[] | null {
  const parts = text.trim().split(/[\s;]+/).filter((one) => one !== "");
  const values = parts.map((one) => (/^[+-]?\d+([.,]\d+)?$/.test(one) ? Number(one.replace(",", ".")) : NaN));
  return values.every((one) => Number.isFinite(one)) ? values : null;
}

class Reader {
  wrong: Wrong | null = null;
  take(text: string, field: Wrong["field"], of: string, counts: readonly number[]): number[] {
    const values = numbers_in(text);
    if (values !== null && counts.includes(values.length)) return values;
    this.wrong ??= { field, of, counts };
    return counts.length > 0 ? new Array<number>(counts[0] ?? 0).fill(0) : [];
  }
  one(text: string, field: Wrong["field"], of: string): number {
    return this.take(text, field, of, [1])[0] ?? 0;
  }
}

const AXES = [6, 7] as const;
const half = (u: number): number => Number((u / 2).toPrecision(12));
const three = (values: number[]): number[] => (values.length === 1 ? [0, 1, 2].map(() => values[0] ?? 0) : values);
const twice = (sigma: number): string => String(Number((sigma * 2).toPrecision(12)));

function place_of(sphere: SphereDraft, read: Reader): Record<string, unknown> {
  if (sphere.place === "taught") return { joints_deg: read.take(sphere.where, "where", sphere.id, AXES) };
  if (sphere.place === "centre") return { centre_mm: read.take(sphere.where, "where", sphere.id, [3]) };
  const six = read.take(sphere.where, "where", sphere.id, [6]);
  return { box_mm: [six.slice(0, 3), six.slice(3)] };
}

const vouched = ({ certificate, date }: Vouched): Record<string, string> => ({
  ...(certificate.trim() === "" ? {} : { certificate: certificate.trim() }),
  ...(date.trim() === "" ? {} : { certificate_date: date.trim() }),
});

/** The `form` to send to the daemon, or the first error. */
export function form_of(draft: CellDraft): { form: unknown } | { wrong: Wrong } {
  const read = new Reader();
  if (draft.robot === "") return { wrong: { field: "robot", of: "", counts: [] } };
  const tool: Record<string, unknown> = {
    xyz_mm: read.take(draft.xyz, "xyz", "", [3]),
    abc_deg: read.take(draft.abc, "abc", "", [3]),
    xyz_sigma_mm: three(read.take(draft.tool_u, "tool_u", "", [1, 3])).map(half),
    tip_radius_mm: read.one(draft.tip, "tip", ""),
  };
  if (draft.mass.trim() !== "") tool.mass_kg = read.one(draft.mass, "mass", "");
  const spheres = draft.spheres.map((sphere) => ({
    id: sphere.id.trim(),
    diameter_mm: read.one(sphere.diameter, "diameter", sphere.id),
    diameter_sigma_mm: half(read.one(sphere.u, "u", sphere.id)),
    ...place_of(sphere, read),
    ...(sphere.place === "box" ? {} : { centre_sigma_mm: half(read.one(sphere.rough, "rough", sphere.id)) }),
    ...(sphere.serial.trim() === "" ? {} : { serial: sphere.serial.trim() }),
    ...vouched(sphere),
  }));
  const lengths = draft.lengths.map((length) => {
    const of = `${length.from}–${length.to}`;
    return {
      from: length.from.trim(), to: length.to.trim(),
      mm: read.one(length.mm, "mm", of), sigma_mm: half(read.one(length.u, "u", of)), ...vouched(length),
    };
  });
  return read.wrong ? { wrong: read.wrong } : { form: { robot: draft.robot, tool, spheres, lengths } };
}

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
export const sphere_drafts = (value: unknown): SphereDraft[] => known(list(value).map(sphere_draft));
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
    mass: tool.mass_kg === undefined ? "" : String(number(tool.mass_kg) ?? ""), tip: String(number(tool.tip_radius_mm) ?? 0),
    spheres, lengths, ...shared_by([...spheres, ...lengths]),
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
