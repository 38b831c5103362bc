// All checks of a calibration as a control chart: does the cell creep, since when, what to do.

import { useMemo } from "preact/hooks";
import type { CheckChart, CheckPoint, ToldController } from "../types";
import { Chart, type Line } from "./chart";
import { useVoice } from "./context";

const LONGEST_S = 1e11; // beyond it a date is none

/** What counts and was measured, in the order of time. */
export const plotted = (points: CheckPoint[]): CheckPoint[] =>
  points.filter((point) => point.leftOut === null && point.offMm !== null && point.timeS < LONGEST_S)
    .sort((one, other) => one.timeS - other.timeS);

export const off_mm = (chart: CheckChart): number | null => {
  const newest = plotted(chart.points).pop()?.offMm;
  return newest ? Math.hypot(...newest) : null;
};

const date_of = (seconds: number): string =>
  seconds > 0 && seconds < LONGEST_S ? new Date(seconds * 1000).toISOString().slice(0, 10) : "–";

function Told({ controller }: { controller: ToldController }) {
  const { say, fmt } = useVoice();
  const { value, at, trouble } = controller;
  return (
    <>
      {value !== null && <p class="note">{say("checks.told", { value, time: fmt.time(at) })}</p>}
      {trouble !== "" && <p class="note" role="status">{say("checks.not_told", { words: trouble })}</p>}
    </>
  );
}

export function Checks({ chart, controller }: { chart: CheckChart; controller: ToldController | null }) {
  const { say, fmt } = useVoice();
  const points = useMemo(() => plotted(chart.points), [chart]);
  const x = useMemo(() => points.map((point) => point.timeS), [points]);
  const places = useMemo((): Line[] => ["x", "y", "z"].map((label, axis) => ({
    label, colour: `axis${axis + 1}`, dashed: axis === 1, values: points.map((point) => point.offMm?.[axis] ?? null),
  })), [points]);
  const statistics = useMemo((): Line[] => [
    { label: say("checks.ewma"), colour: "fit", values: points.map((point) => point.ewma / chart.alarms.ewma) },
    { label: say("checks.cusum"), colour: "goal", dashed: true, values: points.map((point) => point.cusum / chart.alarms.cusum) },
    { label: say("checks.limit"), colour: "next", values: points.map(() => 1) },
    { label: say("checks.beyond"), colour: "next", marks: "triangle",
      values: points.map((point) => (point.state === "warns" || point.state === "alarms" ? point.share : null)) },
  ], [points, chart, say]);
  const { course } = chart;
  const left_out = chart.points.length - chart.counted;
  return (
    <section class="panel wide checks" aria-labelledby="checks-title" data-state={chart.state}>
      <h2 id="checks-title">{say("checks")}</h2>
      <p class="drift-state">
        <strong>{say(`checks.state.${chart.state}`, {
          n: chart.counted, least: chart.least, off: fmt.mm(off_mm(chart)), session: chart.calibration,
          date: date_of(chart.decidedS), undecided: chart.undecided })}</strong>
        {course && <> {course.shape === "creep" && course.mmPerMonth !== null
          ? say("checks.creep", { rate: fmt.mm(course.mmPerMonth), u: fmt.mm(course.uMmPerMonth), since: course.since,
              date: date_of(course.sinceS), off: fmt.mm(course.offMm), u_off: fmt.mm(course.uOffMm) })
          : say("checks.step", { since: course.since, date: date_of(course.sinceS), off: fmt.mm(course.offMm),
              u_off: fmt.mm(course.uOffMm) })}</>}
        {course?.cause && <> {say(`checks.cause.${course.cause}`, {
          name: course.causeName, p: Math.round(100 * course.probability) })}</>}
      </p>
      {chart.advice !== "none" && <p class="drift-advice">{say(`checks.advice.${chart.advice}`)}</p>}
      {controller && <Told controller={controller} />}
      {points.length > 1 && (
        <div class="pair">
          <Chart label={say("checks.label", { n: points.length })} x={x} x_label={say("checks.date")} time
                 y_label={say("checks.off")} lines={places} from={null} />
          <Chart label={say("checks.label.limit", { n: points.length })} x={x} x_label={say("checks.date")} time
                 y_label={say("checks.share")} lines={statistics} />
        </div>
      )}
      {chart.counted > 0 && (
        <p class="note">
          {say("checks.limits", { n: chart.alarms.runLength, warn: chart.warns.runLength })}
          {left_out > 0 && <> {say("checks.left_out", { n: left_out })}</>}
        </p>
      )}
    </section>
  );
}
