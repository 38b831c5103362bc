// Result of a session: verdict, figures, findings, files.

import type { Figures, Result, Summary } from "../types";
import { useVoice } from "./context";
import { OutcomeDetails, OutcomeLine } from "./outcome";

export function ResultPanel({ figures }: { figures: Figures }) {
  const { say, language } = useVoice();
  const { session, result, outcome } = figures;
  return (
    <section class="panel" aria-labelledby="result-title">
      <h2 id="result-title">{say("result", { session })}</h2>
      {outcome ? (
        <>
          <OutcomeLine outcome={outcome}>{result?.publish && <> · {say(`scope.${result.scope}`)}</>}</OutcomeLine>
          <OutcomeDetails outcome={outcome} lang={language} />
        </>
      ) : <p class="note">{say("outcome.none")}</p>}
      {result && <Findings result={result} />}
      <Files session={session} has_result={result !== null} />
    </section>
  );
}

function Findings({ result }: { result: Result }) {
  const { say, fmt } = useVoice();
  const rows = (["before", "after", "check"] as const).filter((one) => result[one].touches > 0);
  return (
    <>
      <div class="scroll" tabIndex={0}><table>
        <thead><tr><td /><th scope="col">{say("result.touches")}</th><th scope="col">{say("result.mean")}</th>
          <th scope="col">{say("result.max")}</th></tr></thead>
        <tbody>{rows.map((one) => <Row key={one} name={say(`result.${one}`)} of={result[one]} />)}</tbody>
      </table></div>
      <p>
        {say("result.predicted", { near: fmt.mm(result.near_targets_mm), all: fmt.mm(result.workspace_mm) })}
        {result.nominal_workspace_u_mm !== null && (
          <>; {say("result.nominal", { all: fmt.size_mm(result.nominal_workspace_mm ?? 0, result.nominal_workspace_u_mm) })}</>
        )}.
      </p>
      <details open={!result.publish}>
        <summary>{say("result.findings")} ({result.findings.length})</summary>
        <ul class="findings">
          {result.findings.map((finding, i) => (
            <li key={i} data-severity={finding.severity}>
              <span class="badge" data-good={finding.severity === "informs"}>{say(`severity.${finding.severity}`)}</span>{" "}
              {finding.words}
            </li>
          ))}
        </ul>
      </details>
    </>
  );
}

function Row({ name, of }: { name: string; of: Summary }) {
  const { fmt } = useVoice();
  return (
    <tr><th scope="row">{name}</th><td>{of.touches}</td><td>{fmt.mm(of.mean_mm)}</td><td>{fmt.mm(of.max_mm)}</td></tr>
  );
}

function Files({ session, has_result }: { session: number; has_result: boolean }) {
  const { say, language } = useVoice();
  const at = `/v1/sessions/${session}`;
  return (
    <p class="files">
      {has_result && <a class="button" href={`${at}/report.html?language=${language}`} target="_blank" rel="noopener">{say("report")}</a>}
      {has_result && <a href={`${at}/calibration.json`} download={`session-${session}-calibration.json`}>{say("calibration.json")}</a>}
      <a href={`${at}/touches.csv`} download={`session-${session}-touches.csv`}>{say("touches.csv")}</a>
    </p>
  );
}
