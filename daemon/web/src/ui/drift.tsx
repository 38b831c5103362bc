// Stability of the arm: results of the sessions of one cell over time.

import { useMemo } from "preact/hooks";
import type { DriftRow } from "../types";
import { Chart, type Line } from "./chart";
import { useVoice } from "./context";

/** Distinguished by colour, and by their order in the legend. */
const AXIS_COLOURS = ["axis1", "axis2", "axis3", "axis4", "axis5", "axis6"];

/** Zero of each joint relative to the oldest session that has it. */
export function zero_changes(rows: DriftRow[]): { joint: string; values: (number | null)[] }[] {
  const names = [...new Set(rows.flatMap((row) => row.zeros.map((zero) => zero.joint)))];
  return names.map((joint) => {
    const values = rows.map((row) => row.zeros.find((zero) => zero.joint === joint)?.deg ?? null);
    const first = values.find((value) => value !== null) ?? 0;
    return { joint, values: values.map((value) => (value === null ? null : value - first)) };
  });
}

/** Withheld results, as of a first session with a few touches, show the priors: beside a calibration they would look like drift. */
export const published = (rows: DriftRow[]): DriftRow[] => rows.filter((row) => row.publish);

export function Drift({ rows: finished }: { rows: DriftRow[] }) {
  const { say } = useVoice();
  const rows = useMemo(() => published(finished), [finished]);
  const x = useMemo(() => rows.map((row) => row.session), [rows]);
  const errors = useMemo((): Line[] => [
    { label: say("drift.fit"), colour: "fit", values: rows.map((row) => row.fit_mm) },
    { label: say("drift.check"), colour: "check", values: rows.map((row) => row.check_mm) },
    { label: say("drift.workspace"), colour: "goal", dashed: true, values: rows.map((row) => row.workspace_mm) },
  ], [rows, say]);
  const zeros = useMemo((): Line[] => zero_changes(rows).map(({ joint, values }, i) => ({
    label: joint, colour: AXIS_COLOURS[i % AXIS_COLOURS.length] ?? "fit", values, dashed: i % 2 === 1,
  })), [rows]);
  return (
    <section class="panel wide" aria-labelledby="drift-title">
      <h2 id="drift-title">{say("drift")}</h2>
      {rows.length < 2 ? <p class="note">{say("drift.none")}</p> : (
        <div class="pair">
          <Chart label={say("drift.label", { n: rows.length })} x={x} x_label={say("history.session")}
                 y_label={say("drift.errors")} lines={errors} />
          {zeros.length > 0 && (
            <Chart label={say("drift.label", { n: rows.length })} x={x} x_label={say("history.session")}
                   y_label={say("drift.zeros")} lines={zeros} from={null} />
          )}
        </div>
      )}
    </section>
  );
}
