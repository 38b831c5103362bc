// Outcome of a session: headline, cause, remedy and evidence.

import type { ComponentChildren } from "preact";
import type { Outcome } from "../types";
import { useVoice } from "./context";

export function OutcomeLine({ outcome, children }: { outcome: Outcome; children?: ComponentChildren }) {
  const { say, fmt } = useVoice();
  const { change, tcp_shift_mm: shift } = outcome;
  const other = outcome.kind === "does_not_hold" && change && change.kind !== "nothing" && change.kind !== "tool"
    ? say(`standing.changed.${change.kind}`, { name: change.name }) : "";
  return (
    <p class="verdict" data-good={outcome.good}>
      <span aria-hidden="true">{outcome.good ? "✔" : "✖"}</span>{" "}
      {say(`outcome.${outcome.kind}`, { n: outcome.kind === "found" ? outcome.spheres.length : outcome.touches })}
      {other ? `: ${other}` : shift && <>: {say("outcome.shift", { shift: fmt.quantity(shift.length, "mm", (shift.u_length ?? 0) / 2) })}</>}
      {children}
    </p>
  );
}

/** `lang`: of its sentences by the daemon. */
export function OutcomeDetails({ outcome, lang }: { outcome: Outcome; lang: string }) {
  const { say, fmt } = useVoice();
  const { change, remedy } = outcome;
  return (
    <div class="outcome">
      {change && change.kind !== "nothing" && (
        <p>{say(`outcome.change.${change.kind}`, {
          name: change.name, touch: change.touch ?? 0,
          value: change.at_least ? say("outcome.at_least", { value: fmt.mm(change.at_least) }) : fmt.quantity(change.value, change.unit, change.u / 2) })}</p>
      )}
      {outcome.not_found.length > 0 && <p>{say("outcome.not_met", { names: outcome.not_found.join(", ") })}</p>}
      {outcome.unsteady.length > 0 && <p>{say("outcome.unsteady", { names: outcome.unsteady.join(", ") })}</p>}
      {(outcome.kind === "qualified" || outcome.kind === "not_qualified") && outcome.words.length > 1 && (
        <ul lang={lang}>{outcome.words.slice(1).map((one) => <li key={one}>{one}</li>)}</ul>
      )}
      {remedy !== "none" && <p><strong>{say(`checks.advice.${remedy}`)}</strong></p>}
      {outcome.spheres.length > 0 && (
        <div class="scroll" tabIndex={0}><table>
          <thead><tr><td /><th scope="col">{say("outcome.centre")}</th><th scope="col">U (k=2)</th>
            <th scope="col">{say("history.touches")}</th><th scope="col">{say("outcome.moved")}</th></tr></thead>
          <tbody>{outcome.spheres.map((one) => (
            <tr key={one.target}><th scope="row">{one.target}</th>
              <td>{one.centre_mm.map((value) => value.toFixed(2)).join(", ")}
                {one.on !== "" && <><br /><code>on = "{one.on}", taught_deg = [{one.taught_deg.map((value) => value.toFixed(2)).join(", ")}]</code></>}</td>
              <td>{fmt.mm(one.u_mm)}</td><td>{one.touches}</td><td>{fmt.mm(one.moved_mm)}</td></tr>
          ))}</tbody>
        </table></div>
      )}
      {outcome.kind === "found" && <p><strong>{say("outcome.found.do")}</strong></p>}
    </div>
  );
}
