// What arrives, as the API's description has it (api.mjs). Never throws and trusts nothing: wrong types become null or defaults,
// lists and texts are cut to bounded sizes. Null where the whole value is unusable.

const MOST_LETTERS = 4000;
const MOST_ITEMS = 5000;
const MOST_NUMBERS = 400_000;
/** Direction marks and line separators, as the daemon's printable() replaces them: in a text of a cell they would turn around the
 *  sentence that holds it. */
const MARKS = /[\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]/g;

/** How a value of type T is read; made by api.mjs. */
export interface Rule<T = unknown> {
  readonly or_null?: Rule;
  readonly type?: "string" | "number" | "integer" | "boolean" | "array" | "object";
  /** The only values, where there is no `other` for all else. */
  readonly words?: readonly (string | number)[];
  readonly other?: string;
  /** Other words are kept. */
  readonly open?: boolean;
  readonly minimum?: number;
  readonly least?: number;
  readonly most?: number;
  readonly items?: Rule;
  readonly properties?: Readonly<Record<string, Rule>>;
  readonly needs?: readonly string[];
  /** Never there: the type alone. */
  readonly made?: T;
}

export const fields = (value: unknown): Record<string, unknown> | null =>
  typeof value === "object" && value !== null && !Array.isArray(value) ? (value as Record<string, unknown>) : null;

export const list = (value: unknown): unknown[] => (Array.isArray(value) ? value.slice(0, MOST_ITEMS) : []);

const numeric = ({ type }: Rule) => type === "number" || type === "integer";
const listed = ({ words }: Rule, value: string | number): boolean => !words || words.includes(value);

/** Undefined: unusable. */
function take(rule: Rule, value: unknown): unknown {
  if (rule.or_null) return take(rule.or_null, value) ?? null;
  switch (rule.type) {
    case "string":
      if (typeof value !== "string") return undefined;
      return rule.open || (rule.other === undefined && !rule.words) ? value.slice(0, MOST_LETTERS).replace(MARKS, " ") : listed(rule, value) ? value : rule.other;
    case "number": return typeof value === "number" && Number.isFinite(value) ? value : undefined;
    case "integer":
      return typeof value === "number" && Number.isInteger(value) && value >= (rule.minimum ?? value) && listed(rule, value) ? value : undefined;
    case "boolean": return typeof value === "boolean" ? value : undefined;
    case "array": return Array.isArray(value) ? items(rule, value) : undefined;
    default: return object(rule, value);
  }
}

/** Lists of numbers, and those with bounds, are whole or nothing. */
function items({ items: of = {}, least = 0, most }: Rule, value: unknown[]): unknown[] | undefined {
  const whole = most !== undefined || numeric(of);
  if (value.length < least || (whole && value.length > (most ?? MOST_NUMBERS))) return undefined;
  const taken = (whole ? value : list(value)).map((one) => take(of, one));
  const usable = taken.filter((one) => one !== undefined && one !== "");
  return whole && usable.length < value.length ? undefined : usable;
}

function object({ properties = {}, needs = [] }: Rule, value: unknown): unknown {
  const all = fields(value);
  if (!all) return undefined;
  const made: Record<string, unknown> = {};
  for (const [key, rule] of Object.entries(properties)) {
    const one = take(rule, all[key]);
    if (needs.includes(key) && (one === undefined || one === "")) return undefined;
    made[key] = one === undefined ? missing(rule) : one;
  }
  return made;
}

function missing(rule: Rule): unknown {
  switch (rule.type) {
    case "string": return rule.other ?? "";
    case "integer": return 0;
    case "boolean": return false;
    case "array": return [];
    default: return object(rule, {});
  }
}

export const read = <T>(rule: Rule<T>, value: unknown): T | null => (take(rule, value) as T | undefined) ?? null;
export const read_all = <T>(rule: Rule<T>, value: unknown): T[] => (Array.isArray(value) ? (items({ items: rule }, value) as T[]) : []);
