// Findings of the doctor on the prerequisites of the first motion, with their remedies.

import { useEffect, useState } from "preact/hooks";
import * as decode from "../decode";
import { asking, get, is_good, is_unanswered, NOT_REFUSED, post, refused_by, type Refusal } from "../request";
import { cell_name } from "../standing";
import type { Doctor, Finding, Readiness } from "../types";
import { CATALOGUES, type Key, type Language, type Say } from "../words";
import { useVoice } from "./context";
import { Refused } from "./refused";

const ASK_EVERY_MS = 1000;
const MARKS: Record<Finding["outcome"], string> = { ok: "✔", warning: "▲", failed: "✖", skipped: "–" };

/** The newest findings; polled while an examination runs, and fetched when `key` changes. */
export function useDoctor(wanted: boolean, key: unknown, language: Language): Doctor | null {
  const [doctor, become] = useState<Doctor | null>(null);
  useEffect(() => {
    if (!wanted) return undefined;
    return asking(() => get(`/v1/doctor?language=${language}`), (answer) => {
      if (is_unanswered(answer)) return undefined;
      const now = answer.status === 200 ? decode.doctor(answer.value) : null;
      become(now);
      return now?.running ? ASK_EVERY_MS : undefined;
    });
  }, [wanted, key, language]);
  return doctor;
}

/** Starts an examination of this cell; returns its refusal. */
export async function examine(cell: string, say: Say): Promise<Refusal> {
  const answer = await post("/v1/doctor", { cell });
  return is_good(answer) ? NOT_REFUSED : refused_by(answer, say);
}

/** `cell`: file that the page shows; the findings may be of another one. `readiness`: null: not known yet. */
export function DoctorPanel({ doctor, readiness, cell, may, begun }: {
  doctor: Doctor; readiness: Readiness | null; cell: string; may: boolean; begun: () => void;
}) {
  const { say, fmt } = useVoice();
  const [refused, set_refused] = useState(NOT_REFUSED);
  const worth = doctor.checks.filter((one) => one.outcome === "failed" || one.outcome === "warning");
  const others = doctor.checks.filter((one) => !worth.includes(one));
  const of_another = doctor.cell !== "" && cell !== "" && doctor.cell !== cell;
  const undone = readiness?.cell === doctor.cell && readiness.steps.some((one) => one.step === "doctor" && one.state === "todo");
  const of_earlier = undone && !doctor.running && doctor.ended !== "";
  const look = async () => {
    set_refused(await examine(cell, say));
    begun();
  };
  return (
    <section class="panel" aria-labelledby="doctor-title" data-doctor={doctor.running ? "running" : doctor.ended === "" ? "none" : "done"}>
      <h2 id="doctor-title">{say("doctor")}</h2>
      {doctor.cell !== "" && <p class="note">{doctor.cell}</p>}
      {of_another && <p class="refused"><span aria-hidden="true">▲ </span>{say("doctor.other", { cell: cell_name(cell) })}</p>}
      {of_earlier && <p class="refused"><span aria-hidden="true">▲ </span>{say("doctor.earlier")}</p>}
      {doctor.running && <p role="status">{say("doctor.running")} {doctor.hint !== "" && <strong>{doctor.hint}</strong>}</p>}
      {!doctor.running && doctor.ended === "" && <p class="note">{say("doctor.none")}</p>}
      {!doctor.running && doctor.ended !== "" && (
        <p>
          <span class="badge" data-good={doctor.green}>
            <span aria-hidden="true">{MARKS[doctor.green ? "ok" : "failed"]}</span>{" "}
            {say(doctor.green ? "doctor.green" : "doctor.failed")}
          </span>{" "}
          <span class="note">{fmt.time(doctor.ended)}</span>
        </p>
      )}
      {worth.length > 0 && <Checks checks={worth} />}
      {others.length > 0 && (
        <details><summary>{say("doctor.others", { n: others.length })}</summary><Checks checks={others} /></details>
      )}
      <Refused by={refused} />
      {may && cell !== "" && !doctor.running && (
        <p class="files"><button type="button" class="small" onClick={() => void look()}>{of_another ? say("doctor.look.cell", { cell: cell_name(cell) }) : say("doctor.look")}</button></p>
      )}
    </section>
  );
}

const is_key = (key: string): key is Key => key in CATALOGUES.en;

function Checks({ checks }: { checks: Finding[] }) {
  const { say } = useVoice();
  return (
    <ul class="findings">
      {checks.map((one, i) => { const name = `check.${one.check}`; return (
        <li key={i} data-outcome={one.outcome}>
          <span class="badge" data-good={one.outcome === "ok"}>
            <span aria-hidden="true">{MARKS[one.outcome]}</span> {say(`outcome.${one.outcome}`)}
          </span>{" "}
          <strong>{is_key(name) ? say(name) : one.check}</strong>: <span>{one.found}</span>
          {one.advice !== "" && <p class="todo">→ {one.advice}</p>}
        </li>
      ); })}
    </ul>
  );
}
