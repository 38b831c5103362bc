// Control chart of all checks of a calibration: drift, its begin, and the remedy.

import { useMemo } from "preact/hooks";
import { named } from "../standing";
import type { AdviceStatus, Cause, DriftChart, DriftEvent, DriftNotHeld, DriftPoint } from "../types";
import { Chart, type Line } from "./chart";
import { useVoice } from "./context";

const LONGEST_S = 1e11; // later dates are invalid

const measured = (point: DriftPoint): boolean => point.left_out === null && point.off_mm !== null;

/** Points that count and were measured, in order of time. */
export const plotted = (points: DriftPoint[]): DriftPoint[] => dated(points).filter(measured);

/** In addition those that do not hold for another reason than the tool: a chart without them would be better than its newest check. */
export const drawn = (points: DriftPoint[]): DriftPoint[] => dated(points).filter((point) => measured(point) || point.holds === false);

const dated = (points: DriftPoint[]): DriftPoint[] =>
  points.filter((point) => point.time_s < LONGEST_S).sort((one, other) => one.time_s - other.time_s);

/** Those of all calibrations of the cell, and where one ends and the next begins. */
export function drawn_of_all(chart: DriftChart): { points: DriftPoint[]; breaks: [number, number][] } {
  const of = new Map<DriftPoint, number>();
  for (const { calibration, points } of [...chart.others, chart]) for (const point of points) of.set(point, calibration);
  const points = drawn([...of.keys()]);
  const breaks = points.flatMap((point, i): [number, number][] => {
    const before = points[i - 1];
    return before && of.get(before) !== of.get(point) ? [[before.time_s, point.time_s]] : [];
  });
  return { points, breaks };
}

export const off_mm = (chart: DriftChart): number | null => {
  const newest = plotted(chart.points).pop()?.off_mm;
  return newest ? Math.hypot(...newest) : null;
};

/** Day in the browser's zone, as on the charts: "2026-12-01". */
export const date_of = (seconds: number): string =>
  seconds > 0 && seconds < LONGEST_S ? new Date(seconds * 1000).toLocaleDateString("sv-SE") : "–";

function Acknowledged({ controller }: { controller: AdviceStatus }) {
  const { say, fmt } = useVoice();
  const { value, told_at, trouble } = controller;
  return (
    <>
      {value !== null && <p class="note">{say("checks.acknowledged", { value, time: fmt.time(told_at) })}</p>}
      {trouble !== "" && <p class="note" role="status">{say("checks.not_acknowledged", { words: trouble })}</p>}
    </>
  );
}

function Because({ cause }: { cause: Cause | null | undefined }) {
  const { say } = useVoice();
  const known = named(cause);
  return known && <> {say(`checks.cause.${known.kind}`, { name: known.name, p: Math.round(100 * (known.probability ?? 0)) })}</>;
}

function NotHeld({ one }: { one: DriftNotHeld }) {
  const { say, fmt } = useVoice();
  return (
    <>
      {say("checks.not_held", { session: one.session, date: date_of(one.time_s) })}
      {one.tcp_shift_mm !== null && <> {say("outcome.shift", { shift: fmt.quantity(one.tcp_shift_mm, "mm", (one.u_tcp_shift_mm ?? 0) / 2) })}.</>}
      {one.since !== one.session && <> {say("checks.not_held.since", { since: one.since, date: date_of(one.since_s) })}</>}
      <Because cause={one.cause} />
    </>
  );
}

function Events({ events, marked }: { events: DriftEvent[]; marked: boolean }) {
  const { say } = useVoice();
  return (
    <>
      <h3>{say("checks.events")}</h3>
      <ol class="events">
        {events.map((event, i) => <li key={i}><time dateTime={date_of(event.time_s)}>{date_of(event.time_s)}</time> {event.words}</li>)}
      </ol>
      {marked && <p class="note">{say("checks.events.why")}</p>}
    </>
  );
}

export function Checks({ chart, controller }: { chart: DriftChart; controller: AdviceStatus | null }) {
  const { say, fmt } = useVoice();
  const { points, breaks } = useMemo(() => drawn_of_all(chart), [chart]);
  const events = useMemo(() => chart.events.map((event) => event.time_s), [chart]);
  const counted = points.filter(measured).length;
  const x = useMemo(() => points.map((point) => point.time_s), [points]);
  const places = useMemo((): Line[] => ["x", "y", "z"].map((label, axis) => ({
    label, colour: `axis${axis + 1}`, dashed: axis === 1, values: points.map((point) => point.off_mm?.[axis] ?? null),
  })), [points]);
  const statistics = useMemo((): Line[] => [
    { label: say("checks.ewma"), colour: "fit", values: points.map((point) => (measured(point) ? point.ewma / chart.alarms.ewma : null)) },
    { label: say("checks.cusum"), colour: "goal", dashed: true,
      values: points.map((point) => (measured(point) ? point.cusum / chart.alarms.cusum : null)) },
    { label: say("checks.limit"), colour: "next", values: points.map(() => 1) },
    { label: say("checks.beyond"), colour: "next", marks: "triangle",
      values: points.map((point) => (measured(point) && (point.state === "warns" || point.state === "alarms") ? point.share : null)) },
    { label: say("checks.failed"), colour: "abort", marks: "square",
      values: points.map((point) => (point.holds === false ? Math.max(1, point.share) : null)) },
  ], [points, chart, say]);
  const warmth = useMemo((): Line[] => [
    { label: say("checks.temperature"), colour: "next", values: points.map((point) => point.temperature_c) },
  ], [points, say]);
  const measured_warmth = points.filter((point) => point.temperature_c !== null).length > 1;
  const { course } = chart;
  const left_out = chart.points.length - chart.counted;
  return (
    <section class="panel wide checks" aria-labelledby="checks-title" data-state={chart.state}>
      <h2 id="checks-title">{say("checks")}</h2>
      <p class="drift-state">
        <strong>{chart.not_held ? <NotHeld one={chart.not_held} /> : say(`checks.state.${chart.state}`, {
          n: chart.counted, least: chart.least, off: fmt.mm(off_mm(chart)), session: chart.calibration,
          date: date_of(chart.decided_s ?? 0), undecided: chart.undecided })}</strong>
        {course && <> {course.shape === "creep" && course.mm_per_month !== null
          ? say("checks.creep", { rate: fmt.mm(course.mm_per_month), u: fmt.mm(course.u_mm_per_month), since: course.since,
              date: date_of(course.since_s), off: fmt.mm(course.off_mm), u_off: fmt.mm(course.u_off_mm) })
          : say(course.shape === "creep" ? "checks.shift" : "checks.step", { since: course.since, date: date_of(course.since_s), off: fmt.mm(course.off_mm),
              u_off: fmt.mm(course.u_off_mm) })}</>}
        {!chart.not_held && <Because cause={course?.causes[0]} />}
      </p>
      {chart.advice !== "none" && <p class="drift-advice">{say(`checks.advice.${chart.advice}`)}</p>}
      {controller && <Acknowledged controller={controller} />}
      {points.length > 1 && (
        <div class="pair">
          <Chart label={say("checks.label", { n: counted })} x={x} x_label={say("checks.date", { zone: fmt.zone })} time
                 y_label={say("checks.off")} lines={places} from={null} events={events} breaks={breaks} />
          <Chart label={say("checks.label.limit", { n: counted })} x={x} x_label={say("checks.date", { zone: fmt.zone })} time
                 y_label={say("checks.share")} lines={statistics} events={events} breaks={breaks} />
          {measured_warmth && (
            <Chart label={say("checks.temperature")} x={x} x_label={say("checks.date", { zone: fmt.zone })} time
                   y_label={say("checks.temperature")} lines={warmth} from={null} events={events} />
          )}
        </div>
      )}
      {chart.events.length > 0 && <Events events={chart.events} marked={points.length > 1} />}
      {chart.counted > 0 && (
        <p class="note">
          {say("checks.limits", { n: chart.alarms.run_length, warn: chart.warns.run_length })}
          {left_out > 0 && <> {say("checks.left_out", { n: left_out })}</>}
        </p>
      )}
    </section>
  );
}
