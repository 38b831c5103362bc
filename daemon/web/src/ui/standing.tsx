// The page's first line: whether the calibration holds, with the session that is due.

import { useEffect, useState } from "preact/hooks";
import type { StandingLine } from "../standing";
import { useVoice } from "./context";
import { StartDialog, WHOLE, type Wish } from "./start";

/** Shapes in addition to the words, so that colour is not needed. */
const MARKS: Record<StandingLine["state"], string> = {
  holds: "✔", does_not_hold: "✖", unknown: "?", none: "○", pending: "…",
};

const WISHES: Record<NonNullable<StandingLine["action"]>, Partial<Wish>> = {
  check: { kind: "check" }, calibrate: WHOLE, measure_tcp: { kind: "update" },
};

/** `small`: a session has priority. `old`: age of the page's data [ms]; 0: current. */
export function Standing({ line, cell, may, small, old, started }: {
  line: StandingLine; cell: string; may: boolean; small: boolean; old: number; started: () => void;
}) {
  const { say, fmt } = useVoice();
  const [open, become] = useState(false);
  const { action } = line;
  useEffect(() => { if (small || !action) become(false); }, [small, action]);
  return (
    <section class="standing" aria-labelledby="standing-title" data-standing={line.state} data-small={small} data-old={old > 0}>
      <div>
        <h2 id="standing-title"><span class="mark" aria-hidden="true">{MARKS[line.state]}</span> {line.headline}</h2>
        <p>{old > 0 && <strong>{say("standing.old", { age: fmt.duration(old / 1000) })} </strong>}{line.more.join(" ")}</p>
      </div>
      {may && action && (
        <button type="button" class={line.state === "holds" ? "" : "go"} onClick={() => become(true)}>{say(`standing.go.${action}`)}</button>
      )}
      {open && action && (
        <StartDialog last_cell={cell} preset={WISHES[action]} close={() => become(false)}
                     done={() => { become(false); started(); }} />
      )}
    </section>
  );
}
