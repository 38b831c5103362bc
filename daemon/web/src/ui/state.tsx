// What the cell is doing, in one sentence: the first thing that is seen and read aloud.

import { age_ms, type Model } from "../model";
import { mood, motion, sentence, type Mood, type Motion } from "../sentence";
import { useVoice } from "./context";

/** Shapes beside the words, so that no colour has to be told from another. */
const MARKS: Record<Motion, string> = { moving: "▶", still: "■", free: "○", unknown: "?" };

export function StatePanel({ model, now }: { model: Model; now: number }) {
  const { say, fmt } = useVoice();
  const { status } = model;
  const old = age_ms(model, now);
  if (!status)
    return (
      <section id="state" class="state" data-mood="unknown">
        <p class="sentence" role="status">{say("link.connecting")} …</p>
        {model.refusal !== "" && <p class="lost" role="alert" lang="en">{model.refusal}</p>}
      </section>
    );
  const shown: Mood = old > 0 ? "unknown" : mood(status);
  const moves: Motion = old > 0 ? "unknown" : motion(status);
  return (
    <section id="state" class="state" data-mood={shown} data-old={old > 0}>
      <p class="motion" data-motion={moves}>
        <span aria-hidden="true">{MARKS[moves]}</span> {say(`motion.${moves}`)}
      </p>
      <p class="sentence" role="status" aria-live="polite">
        {old > 0 ? say("link.unknown") : sentence(status, say)}
      </p>
      {old > 0 && (
        <div class="lost" role="alert">
          <p>
            <strong>{say("link.lost", { age: fmt.duration(old / 1000) })}</strong> {say("link.lost.do")}
          </p>
          <p>{say("link.last", { state: sentence(status, say) })}</p>
        </div>
      )}
      {old === 0 && <Verdict model={model} />}
      {old === 0 && <Waiting model={model} />}
    </section>
  );
}

function Verdict({ model }: { model: Model }) {
  const { say } = useVoice();
  const { status } = model;
  if (status?.phase !== "done" || status.publish === null) return null;
  return (
    <p class="verdict" data-good={status.publish}>
      <span aria-hidden="true">{status.publish ? "✔" : "✖"}</span>{" "}
      {say(status.publish ? "verdict.publish" : "verdict.withheld")}
    </p>
  );
}

function Waiting({ model }: { model: Model }) {
  const { say, fmt } = useVoice();
  const waiting = model.status?.waiting;
  if (!waiting || (!waiting.robot && !waiting.contact)) return null;
  const key = waiting.robot && waiting.contact ? "waiting.both"
    : waiting.robot ? "waiting.robot" : "waiting.contact";
  return (
    <div class="waiting">
      <p>{say(key, { left: fmt.duration(waiting.leftS) })}</p>
      {waiting.robot && waiting.start !== "" && (
        <p><strong lang="en">{say("waiting.start", { what: waiting.start })}</strong></p>
      )}
      {waiting.contact && <p>{say("waiting.sensor.do")}</p>}
    </div>
  );
}
