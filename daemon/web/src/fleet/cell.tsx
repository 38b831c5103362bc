// One cell: its problems, calibrations with documents and certificates, checks, sessions.

import { useEffect, useState } from "preact/hooks";
import { get } from "../request";
import { useFetched, useVoice } from "../ui/context";
import { named, type Say } from "../words";
import { name_of } from "./cells";
import * as decode from "./decode";
import type { FleetCalibration, FleetCell, Need } from "../../generated/api";

const FEW = 10;

interface Download { name: string; href: string }

/** Browsers refuse data addresses above 2 MB. Without a type, so that content written by a cell is never opened as a page of the
 *  plant. */
const download = (file: { name: string; base64: string }): Download => {
  const bytes = Uint8Array.from(atob(file.base64), (one) => one.charCodeAt(0));
  return { name: file.name, href: URL.createObjectURL(new Blob([bytes], { type: "application/octet-stream" })) };
};

function Certificate({ path }: { path: string }) {
  const { say } = useVoice();
  const [files, become] = useState<Download[] | null>(null);
  useEffect(() => () => files?.forEach((file) => URL.revokeObjectURL(file.href)), [files]);
  const ask = async () => {
    const answer = await get(path);
    become(answer.status === 200 ? decode.certificate_files(answer.value).map(download) : []);
  };
  if (files && files.length > 0) return <>{files.map((file) => <a key={file.name} download={file.name} href={file.href}>{file.name} </a>)}</>;
  return (
    <>
      <button type="button" class="small" onClick={() => void ask()}>{say("fleet.certificate")}</button>
      {files && <span class="note" role="status"> {say("fleet.no-answer")}</span>}
    </>
  );
}

/** Evidence of a notice; empty: its heading says all. */
export function detail_words({ what, detail }: Need, say: Say): string {
  switch (what) {
    case "withheld": return detail.split(", ").map((one) => named(say, `finding.${one}`)).join(", ");
    case "check-not-held": return named(say, `fleet.cause.${detail}`);
    case "interrupted": case "overdue": return named(say, `kind.${detail === "calibration" ? "calibrate" : detail}`);
    case "failed": case "gap": return detail;
    default: return "";
  }
}

export function CellDetail({ cell, old }: { cell: FleetCell; old: boolean }) {
  const { say, fmt } = useVoice();
  const path = `/v1/fleet/cells/${cell.plant}/${cell.cell}`;
  const seen = useFetched(path, JSON.stringify(cell), decode.cell_seen);
  useEffect(() => { document.getElementById("cell-title")?.scrollIntoView({ block: "nearest" }); }, [path]);
  const of = (one: FleetCalibration) => `${one.journal}/${one.session}`;
  return (
    <section class={`panel wide${old ? " old" : ""}`} aria-labelledby="cell-title">
      <h2 id="cell-title">{name_of(cell)}</h2>
      {cell.needs.length > 0 && (
        <ul class="needs">{cell.needs.map((need, i) => (
          <li key={i} data-need={need.what}><strong>{say(`fleet.need.${need.what}`)}</strong> {fmt.time(need.since)}
            {detail_words(need, say) !== "" && <>: {detail_words(need, say)}</>} <span class="note">{say(`fleet.do.${need.what}`)}</span></li>
        ))}</ul>
      )}
      {seen && (
        <>
          <h3>{say("fleet.calibrations")}</h3>
          <div class="scroll" tabIndex={0}><table class="history"><tbody>
            {seen.calibrations.slice(0, FEW).map((one) => (
              <tr key={of(one)}>
                <th scope="row">{one.session}</th>
                <td>{fmt.time(one.at)}</td>
                <td>{say(decode.verdict(one))}{one.is_update && <small> {say("fleet.update")}</small>}</td>
                <td>{one.published && fmt.mm(decode.predicted_mm(one))}</td>
                <td><a href={`${path}/calibrations/${of(one)}`} download={`${cell.cell}-${one.session}-calibration.json`}>{say("calibration.json")}</a></td>
                <td>{one.certificate && <Certificate path={`${path}/certificates/${of(one)}`} />}</td>
              </tr>
            ))}
          </tbody></table></div>
          <h3>{say("fleet.checks")}</h3>
          <div class="scroll" tabIndex={0}><table class="history"><tbody>
            {seen.checks.slice(0, FEW).map((one) => (
              <tr key={`${one.journal}/${one.session}`}>
                <th scope="row">{one.session}</th>
                <td>{fmt.time(one.at)}</td>
                <td>{say(`fleet.held.${one.held}`)} {one.shift_mm !== null && <>{fmt.mm(one.shift_mm)} ± {fmt.mm(one.u_mm)}</>}</td>
                <td><a href={`${path}/checks/${one.journal}/${one.session}`} download={`${cell.cell}-${one.session}-check.json`}>{say("check.json")}</a></td>
              </tr>
            ))}
          </tbody></table></div>
          <h3>{say("fleet.sessions")}</h3>
          <div class="scroll" tabIndex={0}><table class="history"><tbody>
            {seen.sessions.slice(0, FEW).map((one, i) => (
              <tr key={i}>
                <th scope="row">{one.session}</th>
                <td>{fmt.time(one.at)}</td>
                <td>{say(`state.${one.state}`)}</td>
                <td>{one.touches}{one.planned > 0 ? `/${one.planned}` : ""}</td>
                <td>{one.failure_kind !== "" && named(say, `failure.${one.failure_kind}`)} <small lang="en">{one.failure}</small></td>
              </tr>
            ))}
          </tbody></table></div>
          {seen.gaps.some((one) => one.settled) && (
            <p class="note">{say("fleet.gaps", { gaps: seen.gaps.filter((one) => one.settled).map((one) => `${one.first}–${one.last}`).join(", ") })}</p>
          )}
          {seen.refused.map((one) => <p class="note" key={one.why}>{say("fleet.refused", { n: one.count, why: named(say, `fleet.refused.${one.why}`) })}</p>)}
        </>
      )}
    </section>
  );
}
