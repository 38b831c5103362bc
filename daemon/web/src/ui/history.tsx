// All sessions, newest first.

import { useState } from "preact/hooks";
import type { SessionRow } from "../types";
import { useVoice } from "./context";
import { steady } from "./steady";

const FEW = 10;
const MARKS: Record<SessionRow["state"], string> = {
  running: "▶", interrupted: "‖", aborted: "■", failed: "✖", done: "✔", damaged: "▲", unknown: "?",
};

/** Outcome of a completed session, since 'done' alone would read as a success. */
function outcome(row: SessionRow) {
  if (row.outcome) return { good: row.outcome.good, word: row.outcome.kind };
  if (row.published !== null) return { good: row.published, word: row.published ? "published" : "withheld" } as const;
  return null;
}

export const History = steady(function History({ sessions, shown, show }: {
  sessions: SessionRow[]; shown: number | null; show: (session: number | null) => void;
}) {
  const { say, fmt, language } = useVoice();
  const [all, set_all] = useState(false);
  const rows = all ? sessions : sessions.slice(0, FEW);
  return (
    <section class="panel wide" aria-labelledby="history-title">
      <h2 id="history-title">{say("history")}</h2>
      {sessions.length === 0 ? <p class="note">{say("history.none")}</p> : (
        <div class="scroll" tabIndex={0}><table class="history sessions">
          <thead><tr>
            {(["session", "started", "state", "touches", "cell", "results"] as const).map((name) => (
              <th scope="col" key={name} class={`column-${name}`}>{say(`history.${name}`, { zone: fmt.zone })}</th>
            ))}
          </tr></thead>
          <tbody>
            {rows.map((row) => { const came = outcome(row); return (
              <tr key={row.id} aria-current={row.id === shown ? "true" : undefined}>
                <th scope="row">{row.id}{row.kind === "qualify" && <small> {say("kind.qualify")}</small>}{row.kind === "check" && <small> {say("kind.check")}</small>}{row.kind === "find" && <small> {say("kind.find")}</small>}{row.kind === "dry-run" && <small> {say("kind.dry-run")}</small>}</th>
                <td>{fmt.time(row.started)}</td>
                <td class="state-word" data-state={row.state}>
                  <span aria-hidden="true">{came && !came.good ? "▲" : MARKS[row.state]}</span> {say(came ? `history.${came.word}` : `state.${row.state}`)}
                </td>
                <td class="column-touches">{row.kind === "dry-run" ? "–" : row.touches + (row.planned > 0 ? `/${row.planned}` : "")}</td>
                <td class="column-cell" title={row.cell}>{row.cell.split("/").pop()}</td>
                <td class="column-results">
                  <button type="button" class="small" aria-expanded={row.id === shown}
                          aria-label={`${say("history.show")} ${row.id}`}
                          onClick={() => show(row.id === shown ? null : row.id)}>
                    {say(row.id === shown ? "close" : "history.show")}
                  </button>
                  {row.state === "done" && row.kind === "qualify" && (
                    <> <a href={`/v1/sessions/${row.id}/qualification.json`} download={`session-${row.id}-qualification.json`}>{say("qualification.json")}</a></>
                  )}
                  {row.state === "done" && row.kind === "find" && (
                    <> <a href={`/v1/sessions/${row.id}/found.json`} download={`session-${row.id}-found.json`}>{say("found.json")}</a></>
                  )}
                  {row.state === "done" && row.kind === "check" && (
                    <> <a href={`/v1/sessions/${row.id}/check.json`} download={`session-${row.id}-check.json`}>{say("check.json")}</a></>
                  )}
                  {row.state === "done" && row.kind === "calibrate" && (
                    <> <a href={`/v1/sessions/${row.id}/report.html?language=${language}`} target="_blank" rel="noopener"
                          aria-label={say("report.of", { session: row.id })}>{say("report")}</a></>
                  )}
                </td>
              </tr>
            ); })}
          </tbody>
        </table></div>
      )}
      {!all && sessions.length > FEW && (
        <button type="button" class="small" onClick={() => set_all(true)}>
          {say("history.more", { n: sessions.length })}
        </button>
      )}
    </section>
  );
});
