// Residuals as they arrive, fit and check separately; and u95 relative to the goal.

import { useMemo } from "preact/hooks";
import type { Status, Touch } from "../types";
import { Chart, type Line } from "./chart";
import { useVoice } from "./context";
import { steady } from "./steady";

/** `found`: of an identification, signed. Otherwise as measured with each touch, unsigned. */
export function Residuals({ touches, found, old = false }: { touches: Touch[]; found: boolean; old?: boolean }) {
  const { say, fmt } = useVoice();
  const known = touches.filter((touch) => touch.residual_mm !== null);
  const x = useMemo(() => known.map((touch) => touch.index + 1), [touches]);
  const lines = useMemo((): Line[] => {
    const of = (set: Touch["set"]) => known.map((touch) => (touch.set === set ? touch.residual_mm : null));
    return [
      { label: say("set.fit"), colour: "fit", marks: "circle", values: of("fit") },
      { label: say("set.check"), colour: "check", marks: "square", values: of("check") },
    ];
  }, [touches, say]);
  const largest = known.reduce((most, touch) => Math.max(most, Math.abs(touch.residual_mm ?? 0)), 0);
  return (
    <section class="panel" aria-labelledby="residuals-title" data-old={old}>
      <h2 id="residuals-title">{say("residuals")}</h2>
      {known.length === 0 ? <p class="note">{touches.length > 0 ? say("residuals.unknown", { n: touches.length }) : say("residuals.none")}</p> : (
        <>
          <Chart label={say("residuals.label", { n: known.length, max: fmt.mm(largest) })}
                 x={x} x_label={say("residuals.axis")} lines={lines} from={found ? null : 0}
                 y_label={say(found ? "residuals.found" : "residuals.unit")} />
          <details>
            <summary>{say("table")}</summary>
            <div class="scroll" tabIndex={0}><TouchTable touches={touches} /></div>
          </details>
        </>
      )}
    </section>
  );
}

const TouchTable = steady(function TouchTable({ touches }: { touches: Touch[] }) {
  const { say, fmt } = useVoice();
  return (
    <table>
      <thead><tr>
        {(["touch", "target", "set", "residual"] as const).map((name) => (
          <th scope="col" key={name}>{say(`column.${name}`)}</th>
        ))}
      </tr></thead>
      <tbody>
        {touches.map((touch) => (
          <tr key={touch.index}>
            <td>{touch.index + 1}</td><td>{touch.target}</td><td>{say(`set.${touch.set}`)}</td>
            <td>{fmt.mm(touch.residual_mm)}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
});

export function Accuracy({ touches, status, old }: { touches: Touch[]; status: Status; old: boolean }) {
  const { say, fmt } = useVoice();
  const known = touches.filter((touch) => touch.u95_mm !== null);
  const x = useMemo(() => known.map((touch) => touch.index + 1), [touches]);
  const lines = useMemo((): Line[] => [
    { label: say("progress.u95"), colour: "fit", values: known.map((touch) => touch.u95_mm) },
    { label: say("u95.goal"), colour: "goal", dashed: true, values: known.map(() => status.goal_mm) },
  ], [touches, status.goal_mm, say]);
  if (status.goal_mm === null && known.length === 0) return null;
  return (
    <section class="panel" aria-labelledby="u95-title" data-old={old}>
      <h2 id="u95-title">{say("u95")}</h2>
      {known.length === 0 ? <p class="note">{say("residuals.none")}</p> : (
        <Chart x={x} x_label={say("residuals.axis")} y_label={say("u95.unit")} lines={lines}
               label={say("u95.label", { now: fmt.mm(known.at(-1)?.u95_mm ?? null), n: known.length, goal: fmt.mm(status.goal_mm) })} />
      )}
    </section>
  );
}
