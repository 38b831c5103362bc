// Numbers with their units, in the format of the language.

import { now_ms } from "./clock";
import type { Language } from "./words";

export interface Formats {
  mm: (value: number | null) => string;
  /** With two significant digits: 0.10 mm. */
  short_mm: (value: number) => string;
  /** With its U, to the digit of that: 1.02 ± 0.05 mm. */
  size_mm: (value: number, u: number) => string;
  ms: (value: number | null) => string;
  us: (value: number | null) => string;
  degrees: (value: number, digits?: number) => string;
  /** With U = 2 sigma where stated. */
  quantity: (value: number, unit: string, sigma: number) => string;
  whole: (value: number | null) => string;
  duration: (seconds: number | null) => string;
  /** With one decimal below a few seconds. */
  seconds: (seconds: number) => string;
  /** Local time of day of an instant [ms since 1970]. */
  clock: (ms: number) => string;
  time: (iso: string) => string;
  /** Name of the zone of these times. */
  zone: string;
  /** Day of an instant, ISO 8601 or in seconds since 1970: "25 Nov", with the year where it is not the current one. */
  day: (instant: string | number) => string;
}

export const NONE = "–";
const SPACE = "\u00a0";
/** Typographic forms of the daemon's units. */
const UNITS: Record<string, string> = { deg: "°", sigma: "σ" };

/** The month in letters: 5/11 is ambiguous. */
function day(instant: string | number, language: Language): string {
  const when = new Date(typeof instant === "number" ? instant * 1000 : instant);
  if (Number.isNaN(when.getTime())) return NONE;
  const year = when.getFullYear() === new Date(now_ms()).getFullYear() ? undefined : "numeric";
  return when.toLocaleDateString(language === "en" ? "en-GB" : language, { day: "numeric", month: "short", year })
    .replace(/ /g, SPACE);
}

/** Year, month, day: the unambiguous order. Made once: that takes as long as writing a hundred times. */
const TIME = new Intl.DateTimeFormat("sv-SE", { dateStyle: "short", timeStyle: "short" });

export function formats(language: Language): Formats {
  const decimal = (value: number, digits: number) =>
    value.toLocaleString(language, { minimumFractionDigits: digits, maximumFractionDigits: digits });
  const with_unit = (unit: string, digits: (size: number) => number) => (value: number | null) =>
    value === null ? NONE : decimal(value, digits(Math.abs(value))) + SPACE + unit;
  return {
    mm: with_unit("mm", (size) => (size < 0.9995 ? 3 : size < 99.95 ? 2 : 1)),
    short_mm: (value) => decimal(value, value < 0.0995 ? 3 : value < 9.95 ? 2 : 1) + SPACE + "mm",
    size_mm: (value, u) => {
      const digits = u > 0 ? Math.min(3, Math.max(1, Math.ceil(-Math.log10(u)))) : 2;
      return decimal(value, digits) + (u > 0 ? `${SPACE}±${SPACE}${decimal(u, digits)}` : "") + SPACE + "mm";
    },
    ms: with_unit("ms", (size) => (size < 0.9995 ? 3 : 1)),
    us: with_unit("µs", () => 0),
    degrees: (value, digits = 4) =>
      (value >= 0 ? "+" : "−") + decimal(Math.abs(value), digits) + "°",
    quantity: (value, unit, sigma) => {
      const fine = unit === "mm" ? 3 : unit === "deg" ? 4 : Number.isInteger(value) ? 0 : 1;
      const u = sigma > 0 ? `${SPACE}±${SPACE}${decimal(2 * sigma, fine)}` : "";
      return decimal(value, fine) + u + (unit === "" ? "" : SPACE + (UNITS[unit] ?? unit));
    },
    whole: (value) => (value === null ? NONE : value.toLocaleString(language)),
    duration: (seconds) => (seconds === null ? NONE : duration(seconds)),
    seconds: (seconds) => decimal(seconds, 1) + SPACE + "s",
    day: (instant) => day(instant, language),
    clock: (ms) => new Date(ms).toLocaleTimeString("sv-SE"),
    time: (iso) => {
      const when = new Date(iso);
      return Number.isNaN(when.getTime()) ? NONE : TIME.format(when);
    },
    // Not an offset, which changes within a year. It may be broken after its slashes.
    zone: TIME.resolvedOptions().timeZone.replace(/\//g, "/\u200b"),
  };
}

/** With its beginning and end where it is long: names of one kind differ at the end. */
export function shortened(text: string): string {
  const letters = [...text];
  return letters.length <= 13 ? text : `${letters.slice(0, 4).join("")}…${letters.slice(-8).join("")}`;
}

/** As one word of a shell, for commands that the user is to enter. */
export function shell_word(text: string): string {
  return /^[A-Za-z0-9/._+:,@%-]+$/.test(text) ? text : `'${text.replace(/'/g, "'\\''")}'`;
}

function duration(seconds: number): string {
  const whole = Math.max(0, Math.round(seconds));
  if (whole < 60) return `${whole}${SPACE}s`;
  const minutes = Math.floor(whole / 60);
  if (minutes < 60) return `${minutes}${SPACE}min ${whole % 60}${SPACE}s`;
  return `${Math.floor(minutes / 60)}${SPACE}h ${minutes % 60}${SPACE}min`;
}
