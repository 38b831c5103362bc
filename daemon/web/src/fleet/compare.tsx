// Comparison of one joint over all robots of a model, to find deviating ones.

import { useEffect, useState } from "preact/hooks";
import { useFetched, useVoice } from "../ui/context";
import * as decode from "./decode";
import type { FleetCell } from "../../generated/api";

const JOINTS = ["A1", "A2", "A3", "A4", "A5", "A6"];
const DIGITS = 4;

export function Compare({ cells }: { cells: FleetCell[] }) {
  const { say, language } = useVoice();
  const models = [...new Set(cells.map((one) => one.robot).filter((one) => one !== ""))].sort();
  const [robot, choose_robot] = useState(models[0] ?? "");
  const [joint, choose_joint] = useState("A1");
  const [parameter, choose_parameter] = useState("");
  useEffect(() => { if (robot === "" && models[0]) choose_robot(models[0]); }, [models[0]]);
  const asked = robot === "" ? null : `/v1/fleet/compare?robot=${encodeURIComponent(robot)}&joint=${encodeURIComponent(joint)}`;
  const seen = useFetched(asked, decode.calibrations_in_use(cells), (value) => {
    const all = decode.corrections(value);
    return all && { asked, all };
  });
  const told = decode.of_asked(seen, asked), all = told ?? [];
  const parameters = [...new Set(all.map((one) => one.parameter))];
  const shown = parameters.includes(parameter) ? parameter : parameters[0] ?? "";
  const rows = all.filter((one) => one.parameter === shown);
  const largest = Math.max(...rows.map((one) => Math.abs(one.correction) + 2 * one.sigma), 0);
  const value = (number: number) => number.toLocaleString(language, { maximumFractionDigits: DIGITS, minimumFractionDigits: DIGITS });
  const select = (name: "robot" | "joint" | "parameter", from: string[], now: string, choose: (one: string) => void) => (
    <label>{say(`fleet.compare.${name}`)}
      <select name={name} value={now} onChange={(event) => choose(event.currentTarget.value)}>
        {from.map((one) => <option key={one} value={one}>{one}</option>)}
      </select>
    </label>
  );
  if (models.length === 0) return null;
  return (
    <section class="panel wide" aria-labelledby="compare-title">
      <h2 id="compare-title">{say("fleet.compare")}</h2>
      <div class="look">
        {select("robot", models, robot, choose_robot)}
        {select("joint", JOINTS, joint, choose_joint)}
        {parameters.length > 0 && select("parameter", parameters, shown, choose_parameter)}
      </div>
      {rows.length === 0 ? <p class="note">{say(told ? "fleet.compare.none" : "fleet.asking")}</p> : (
        <div class="scroll" tabIndex={0}><table class="history compare">
          <thead><tr>
            <th scope="col">{say("fleet.column.cell")}</th>
            <th scope="col">{say("fleet.compare.correction", { unit: rows[0]?.unit ?? "" })}</th>
            <td aria-hidden="true" />
          </tr></thead>
          <tbody>
            {rows.map((one) => (
              <tr key={`${one.plant}/${one.cell}`}>
                <th scope="row">{one.plant}/{one.cell} <small>{one.robot_serial}</small></th>
                <td>{value(one.correction)} ± {value(2 * one.sigma)}</td>
                <td aria-hidden="true" class="bar">
                  <svg viewBox="-100 0 200 10" preserveAspectRatio="none">
                    <line x1="0" x2="0" y1="0" y2="10" />
                    {largest > 0 && <line class="range" x1={(100 * (one.correction - 2 * one.sigma)) / largest} x2={(100 * (one.correction + 2 * one.sigma)) / largest} y1="5" y2="5" />}
                    {largest > 0 && <rect x={(100 * one.correction) / largest - 1.5} y="1" width="3" height="8" />}
                  </svg>
                </td>
              </tr>
            ))}
          </tbody>
        </table></div>
      )}
      <p class="note">{say("fleet.compare.note")}</p>
    </section>
  );
}
