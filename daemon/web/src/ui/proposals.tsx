// Open proposals of the plant, to be accepted or refused. Neither causes motion.

import { useState } from "preact/hooks";
import type { Proposal, ProposalsSeen } from "../types";
import { useVoice } from "./context";
import { SayWhy } from "./say_why";

const FEW = 3;

export function Proposals({ seen, may, changed }: { seen: ProposalsSeen; may: boolean; changed: () => void }) {
  const { say, fmt } = useVoice();
  const [asked, ask] = useState<{ of: Proposal; verb: "accept" | "refuse" } | null>(null);
  const open = seen.proposals.filter((one) => one.stand === "open");
  const to_do = seen.proposals.filter((one) => one.stand === "accepted" && one.file !== "").slice(0, FEW);
  if (open.length === 0 && seen.problem === "" && to_do.length === 0) return null;
  const wish = (one: Proposal) => say(`proposal.${one.kind}`, { session: one.session ?? "" });
  const done = () => {
    ask(null);
    changed();
  };
  return (
    <section class="panel wide proposals" aria-labelledby="proposals-title">
      <h2 id="proposals-title">{say("proposals")}</h2>
      {seen.problem !== "" && <p class="refused">{seen.problem}</p>}
      <ul>
        {open.map((one) => (
          <li key={one.id}>
            <strong>{wish(one)}</strong> {say("proposal.by", { by: one.by, time: fmt.time(one.received) })} {one.reason}
            {one.text !== "" && <pre>{one.text}</pre>}
            {may && (
              <div class="buttons">
                <button type="button" class="small" aria-label={`${say("proposal.accept")} ${one.id}`}
                        onClick={() => ask({ of: one, verb: "accept" })}>{say("proposal.accept")}</button>
                <button type="button" class="small" aria-label={`${say("proposal.refuse")} ${one.id}`}
                        onClick={() => ask({ of: one, verb: "refuse" })}>{say("proposal.refuse")}</button>
              </div>
            )}
          </li>
        ))}
      </ul>
      {to_do.map((one) => (
        <p class="note" key={one.id}>{say(one.kind === "priors" ? "proposal.to_do.priors" : "proposal.to_do.schedule", {
          file: one.file, command: one.command, time: fmt.time(one.decided), by: one.decided_by })}</p>
      ))}
      {asked && (
        <SayWhy title={wish(asked.of)} go={say(`proposal.${asked.verb}`)} needed={asked.verb === "refuse"}
                path={`/v1/proposals/${encodeURIComponent(asked.of.id)}/${asked.verb}`} body={{}} close={() => ask(null)} done={done}>
          <p>{say(`proposal.${asked.of.kind}.means`)}</p>
        </SayWhy>
      )}
    </section>
  );
}
