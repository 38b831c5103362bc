// Published calibrations of the cell: the one in use, comparison of two, reactivation of another.

import { useEffect, useState } from "preact/hooks";
import * as decode from "../decode";
import { asking, get, is_unanswered } from "../request";
import type { Comparison, Version } from "../types";
import { useVoice } from "./context";
import { SayWhy } from "./say_why";
import { steady } from "./steady";

const FEW = 5;

export const Versions = steady(function Versions({ versions, may, changed }: { versions: Version[]; may: boolean; changed: () => void }) {
  const { say, fmt } = useVoice();
  const [all, set_all] = useState(false);
  const [wanted, want] = useState<Version | null>(null);
  const [beside, set_beside] = useState<number | null>(null);
  const [compared, become] = useState<Comparison | "none" | null>(null);
  const in_use = versions.find((one) => one.active);
  const apart = beside !== in_use?.session ? beside : null; // no comparison with itself
  useEffect(() => {
    become(null);
    if (apart === null || !in_use) return undefined;
    return asking(() => get(`/v1/versions/compare?before=${apart}&after=${in_use.session}`), (answer) => {
      if (!is_unanswered(answer)) become((answer.status === 200 ? decode.comparison(answer.value) : null) ?? "none");
    });
  }, [apart, in_use?.session]);
  const rows = all ? versions : versions.slice(0, FEW);
  return (
    <section class="panel wide versions" aria-labelledby="versions-title">
      <h2 id="versions-title">{say("versions")}</h2>
      <div class="scroll" tabIndex={0}><table class="history">
        <thead><tr>
          {(["session", "published", "predicted", "u95", "use"] as const).map((name) => (
            <th scope="col" key={name}>{say(`versions.${name}`, { zone: fmt.zone })}</th>
          ))}
        </tr></thead>
        <tbody>
          {rows.map((row) => (
            <tr key={row.session} aria-current={row.active ? "true" : undefined}>
              <th scope="row">{row.session}</th>
              <td>{fmt.time(row.ended)}</td>
              <td>{row.trouble ? say("versions.damaged") : <>{fmt.mm(row.predicted_mm)} <small>{say(row.scope === "workspace" ? "versions.workspace" : "versions.near")}</small></>}</td>
              <td>{fmt.mm(row.u95_mm)}</td>
              <td>
                {row.active ? <strong>{say("versions.in_use")}</strong> : !row.trouble && (
                  <>
                    <button type="button" class="small" aria-label={`${say("versions.compare")} ${row.session}`}
                            aria-expanded={apart === row.session}
                            onClick={() => set_beside(apart === row.session ? null : row.session)}>{say("versions.compare")}</button>
                    {may && <> <button type="button" class="small" aria-label={`${say("versions.activate")} ${row.session}`}
                                       onClick={() => want(row)}>{say("versions.activate")}</button></>}
                  </>
                )}
                {row.trouble && <div class="note">{row.trouble}</div>}
                {row.activated && <div class="note">{say("versions.activated", { time: fmt.time(row.activated.time), who: row.activated.who, reason: row.activated.reason })}</div>}
              </td>
            </tr>
          ))}
        </tbody>
      </table></div>
      {apart !== null && in_use && compared !== null && (
        <p class="compared" role="status">
          {compared === "none" ? say("versions.not_compared")
            : compared.mean_mm === null ? say("versions.not_comparable", { before: apart, after: in_use.session })
            : say("versions.apart", { before: apart, after: in_use.session, mean: fmt.mm(compared.mean_mm), max: fmt.mm(compared.max_mm),
                expected: fmt.mm(compared.expected_mm), moved: compared.moved.length === 0 ? NONE : compared.moved.map((one) => one.name).join(", ") })}
          {compared !== "none" && compared.only_before.length > 0 && ` ${say("versions.only", { session: apart, names: named(compared.only_before) })}`}
          {compared !== "none" && compared.only_after.length > 0 && ` ${say("versions.only", { session: in_use.session, names: named(compared.only_after) })}`}
          {compared !== "none" && compared.not_compared.length > 0 && ` ${say("versions.frame", { names: named(compared.not_compared) })}`}
        </p>
      )}
      {!all && versions.length > FEW && (
        <button type="button" class="small" onClick={() => set_all(true)}>{say("history.more", { n: versions.length })}</button>
      )}
      {wanted && (
        <SayWhy title={say("versions.activate.title", { session: wanted.session })} go={say("versions.activate")} needed
                path="/v1/versions/activate" body={{ session: wanted.session }} close={() => want(null)}
                done={() => { want(null); changed(); }}>
          <p>{say("versions.activate.hint")}</p>
        </SayWhy>
      )}
    </section>
  );
});

const NONE = "–";
const NAMED = 8; // another model level has dozens of its own
const named = (names: string[]) => names.slice(0, NAMED).join(", ") + (names.length > NAMED ? " …" : "");
