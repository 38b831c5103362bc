// The page's first line: whether the calibration holds, how good it is, since when, and what to do. cellcald decides whether it
// holds; this is its wording. Pure.

import type { Formats } from "./format";
import { mood } from "./sentence";
import type { Cause, DriftChart, DriftSeen, Holding, Readiness, Status, Version } from "./types";
import type { Key, Say } from "./words";

export interface StandingLine {
  /** none: nothing published; pending: no answer yet. */
  state: Holding | "none" | "pending";
  headline: string;
  /** Accuracy or evidence where the headline lacks it, and the remedy. */
  more: string[];
  /** Session that the remedy asks for. */
  action: "check" | "calibrate" | "measure_tcp" | null;
}

/** amiss: the newest session failed, was aborted or interrupted, and is looked at first; withheld: its result; lost: data of the past. */
export type Now = "calm" | "running" | "amiss" | "withheld" | "lost";

export const now_of = (status: Status | null, old: boolean): Now =>
  old ? "lost" : status?.running ? "running" : !status || !["wait", "bad"].includes(mood(status)) ? "calm"
  : status.phase === "done" ? "withheld" : "amiss";

const S_PER_MIN = 60, S_PER_H = 3600, S_PER_DAY = 86400;

/** Duration in its largest unit: "2 h". */
export function age_words(seconds: number, say: Say): string {
  const at_least = Math.max(0, seconds);
  if (at_least < 1.5 * S_PER_MIN) return say("age.minute");
  if (at_least < 1.5 * S_PER_H) return say("age.minutes", { n: Math.round(at_least / S_PER_MIN) });
  if (at_least < 2 * S_PER_DAY) return say("age.hours", { n: Math.round(at_least / S_PER_H) });
  return say("age.days", { n: Math.floor(at_least / S_PER_DAY) });
}

/** "weld-3" of ".../weld-3.toml", "demo" of ".../demo/cell.toml". */
export function cell_name(file: string): string {
  const parts = file.split("/");
  const folder = parts.at(-2) ?? "", stem = (parts.at(-1) ?? "").replace(/\.toml$/, "");
  // Folders that hold cells of any name.
  return stem === "cell" && !["", "cellcal", "cells"].includes(folder) ? folder : stem;
}

function accuracy(version: Version | undefined, say: Say, fmt: Formats): string {
  const scope = version && version.scope !== "workspace" ? ` ${say("standing.near")}` : "";
  if (version && version.u95_mm !== null) return say("standing.u95", { u: fmt.short_mm(version.u95_mm) }) + scope;
  if (version && version.predicted_mm !== null) return say("standing.mean", { mean: fmt.short_mm(version.predicted_mm) }) + scope;
  return say("standing.accuracy.unknown");
}

type Named = Cause & { kind: Exclude<Cause["kind"], "nothing" | "unknown"> };
const is_named = (cause: Cause): cause is Named => cause.kind !== "nothing" && cause.kind !== "unknown";
export const named = (cause: Cause | null | undefined): Named | null => (cause && is_named(cause) ? cause : null);

/** Cause of a calibration that does not hold. */
function changed(chart: DriftChart, say: Say, fmt: Formats): string {
  const { not_held, course } = chart;
  const cause = named(not_held ? not_held.cause : course?.causes[0]);
  const off = not_held ? not_held.tcp_shift_mm : course?.off_mm ?? null;
  const u = (not_held ? not_held.u_tcp_shift_mm : course?.u_off_mm) ?? 0;
  const by = off === null ? "" : fmt.size_mm(off, u);
  if (cause?.kind === "tool" && by !== "") return say("standing.changed.tool", { by });
  if (cause && cause.kind !== "tool") return say(`standing.changed.${cause.kind}`, { name: cause.name });
  return by === "" ? say("standing.changed.unmet") : say("standing.changed.tcp", { by });
}

function unknown_because(chart: DriftChart, now_s: number, say: Say): string {
  const { standing } = chart;
  if (!standing) return say("standing.unknown.old_daemon");
  if (chart.undecided > 0) return say("standing.unknown.undecided");
  if (standing.due_s !== null && now_s > standing.due_s) return say("standing.unknown.late", { age: age_words(now_s - standing.evidence_s, say) });
  if (standing.due_s !== null && now_s < standing.evidence_s - S_PER_DAY) return say("standing.unknown.clock");
  return say("standing.unknown.contradicted");
}

/** What to do about a calibration in order: another panel says it of what is amiss. */
const in_order: Record<Now, Key[]> = { calm: ["standing.nothing"], running: ["standing.none.running"], amiss: [], withheld: [], lost: [] };

function of_chart(chart: DriftChart, version: Version | undefined, cell: string, now: Now, now_s: number, say: Say, fmt: Formats): StandingLine {
  const { standing } = chart;
  const of_another = cell !== "" && chart.cell !== "" && cell !== chart.cell;
  const state = standing?.holds ?? "unknown";
  const good = accuracy(version, say, fmt);
  const date = fmt.day(chart.calibrated) + (of_another ? ` (${cell_name(chart.cell)})` : "");
  const advised = chart.advice === "none" ? [] : [say(`checks.advice.${chart.advice}`)];
  const repair = chart.advice === "recalibrate" ? "calibrate" : chart.advice === "re_measure_tcp" ? "measure_tcp" : "check";
  if (state === "holds" && standing) {
    const by = standing.by_check ? "checked" : "unchecked";
    const age = age_words(now_s - standing.evidence_s, say);
    const due = standing.due_s === null ? [] : [say("standing.due", { due: fmt.day(standing.due_s) })];
    const todo = chart.state === "warns" ? [say("standing.warns"), ...advised]
      : now === "calm" && due.length > 0 ? due : [...in_order[now].map((key) => say(key)), ...due];
    return { state, action: "check", more: todo,
             headline: standing.due_s === null ? say(`standing.emulated.${by}`, { good }) : say(`standing.holds.${by}`, { date, good, age }) };
  }
  if (state === "does_not_hold") {
    const since = chart.not_held?.since_s ?? chart.course?.since_s ?? 0;
    return { state, action: repair,
             headline: say("standing.broken", { date, what: changed(chart, say, fmt) }),
             more: [...advised, say("standing.broken.since", { since: fmt.day(since), good })] };
  }
  return { state, action: "check", headline: say("standing.unknown", { date, why: unknown_because(chart, now_s, say) }),
           more: [say("standing.check"), say("standing.unknown.good", { good })] };
}

export function standing_line(seen: {
  drift: DriftSeen | null; versions: Version[] | null; readiness: Readiness | null; now: Now;
  /** Cell file that the page is named after. */
  cell: string;
}, now_s: number, say: Say, fmt: Formats): StandingLine {
  const { drift, versions, readiness } = seen;
  const damaged = versions?.find((one) => one.active && one.trouble !== "");
  if (damaged)
    return { state: "unknown", action: null, more: [damaged.trouble],
             headline: say("standing.damaged", { session: damaged.session }) };
  // Without the versions the accuracy is not known, which is not an accuracy that is not stated.
  if (!drift || !versions) return { state: "pending", headline: say("standing.pending"), more: [], action: null };
  if (drift?.checks) {
    const { calibration, calibrated } = drift.checks;
    // Checks of the calibration would be refused.
    if (readiness?.steps.some((one) => one.step === "calibration" && one.state === "wrong" && one.session === calibration))
      return { state: "unknown", headline: say("standing.unlike", { date: fmt.day(calibrated) }), more: [say("standing.unlike.do")], action: "calibrate" };
    return of_chart(drift.checks, versions.find((one) => one.session === calibration), seen.cell, seen.now, now_s, say, fmt);
  }
  if (versions.length > 0)
    return { state: "unknown", headline: say("standing.unreadable"), more: [say("standing.unreadable.do")], action: null };
  const next: Key = seen.now === "running" ? "standing.none.running" : readiness?.next ? "standing.none.next" : "standing.none.do";
  return { state: "none", headline: say("standing.none"), action: readiness?.next ? null : "calibrate",
           more: ["amiss", "lost"].includes(seen.now) ? [] : [say(next, { step: readiness?.next ? say(`step.${readiness.next}`) : "" })] };
}
