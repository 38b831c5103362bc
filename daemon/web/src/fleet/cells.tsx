// One row per cell; those that need attention first, in the collector's order.

import { useState } from "preact/hooks";
import { NONE } from "../format";
import { useVoice } from "../ui/context";
import { steady } from "../ui/steady";
import type { FleetCell } from "../../generated/api";
import { predicted_mm } from "./decode";

const FEW = 50;
const COLUMNS = ["cell", "needs", "calibration", "predicted", "check", "robot"] as const;

export const name_of = (cell: FleetCell): string => `${cell.plant}/${cell.cell}`;
const fits = (cell: FleetCell, text: string): boolean =>
  `${name_of(cell)} ${cell.robot} ${cell.robot_serial}`.toLowerCase().includes(text.trim().toLowerCase());

export const CellTable = steady(function CellTable({ cells, old, chosen, choose }: {
  cells: FleetCell[]; old: boolean; chosen: string | null; choose: (name: string | null) => void;
}) {
  const { say, fmt } = useVoice();
  const [text, search] = useState("");
  const [all, set_all] = useState(false);
  const found = cells.filter((one) => fits(one, text));
  const rows = all ? found : found.slice(0, FEW);
  return (
    <section class={`panel wide${old ? " old" : ""}`} aria-labelledby="cells-title">
      <h2 id="cells-title">{say("fleet.cells")}</h2>
      <label>{say("fleet.search")} <input type="text" name="search" value={text} onInput={(event) => search(event.currentTarget.value)} /></label>
      <div class="scroll" tabIndex={0}><table class="history fleet-cells">
        <thead><tr>{COLUMNS.map((name) => <th scope="col" key={name}>{say(`fleet.column.${name}`)}</th>)}</tr></thead>
        <tbody>
          {rows.map((cell) => {
            const name = name_of(cell), shown = name === chosen;
            return (
              <tr key={name} aria-current={shown ? "true" : undefined} data-needs={cell.needs[0]?.what ?? "none"}>
                <th scope="row">
                  <button type="button" class="small" aria-expanded={shown} onClick={() => choose(shown ? null : name)}>{name}</button>
                  {cell.mock && <small> {say("fleet.mock")}</small>}
                </th>
                <td>
                  {cell.needs.length === 0 ? <span class="well">{say("fleet.well")}</span>
                    : <ul class="needs">{cell.needs.map((need, i) => (
                        <li key={i} data-need={need.what}>{say(`fleet.need.${need.what}`)} <small>{fmt.time(need.since)}</small></li>
                      ))}</ul>}
                </td>
                <td>{cell.calibration === null ? NONE : <>{cell.calibration} <small>{fmt.time(cell.calibrated_at)}</small></>}</td>
                <td>{fmt.mm(predicted_mm(cell))}</td>
                <td>{cell.held === null ? NONE : <>{say(`fleet.held.${cell.held}`)} {cell.shift_mm !== null && fmt.mm(cell.shift_mm)} <small>{fmt.time(cell.checked_at)}</small></>}</td>
                <td>{cell.robot || NONE} <small>{cell.robot_serial}</small></td>
              </tr>
            );
          })}
        </tbody>
      </table></div>
      {found.length === 0 && <p class="note">{say("fleet.not-found")}</p>}
      {!all && found.length > FEW && (
        <button type="button" class="small" onClick={() => set_all(true)}>{say("history.more", { n: found.length })}</button>
      )}
    </section>
  );
});
