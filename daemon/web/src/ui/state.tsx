// State of the cell in one sentence: the first element seen and read aloud.

import { useEffect, useRef, useState } from "preact/hooks";
import { now_ms } from "../clock";
import { age_ms, type Model } from "../model";
import { mood, motion, motion_words, near_words, sentence, then_words, type Mood, type Motion } from "../sentence";
import type { Outcome, PlannedTouch, Status } from "../types";
import { useTranslated, useVoice } from "./context";
import { OutcomeDetails, OutcomeLine } from "./outcome";
import { Progress } from "./progress";

/** Shapes in addition to the words, so that colour is not needed. */
const MARKS: Record<Motion, string> = { moving: "▶", still: "■", free: "○", unknown: "?" };

const SPOKEN_EVERY_MS = 6000;

/** Text for screen readers, rate-limited: a touch has ten phases. */
function useCalm(words: string, at_once: boolean): string {
  const [spoken, speak] = useState(words);
  const last = useRef(0);
  useEffect(() => {
    const wait = at_once ? 0 : Math.max(0, last.current + SPOKEN_EVERY_MS - performance.now());
    const timer = setTimeout(() => {
      last.current = performance.now();
      speak(words);
    }, wait);
    return () => clearTimeout(timer);
  }, [words, at_once]);
  return spoken;
}

/** `why`: first finding that withholds the session's result; empty: none, or not known yet. */
export function StatePanel({ model, plan, now, why }: {
  model: Model; plan: PlannedTouch[]; now: number; why: string;
}) {
  const { say, fmt } = useVoice();
  const { status } = model;
  const old = age_ms(model, now);
  const words = !status ? "" : old > 0 ? say("link.unknown") : sentence(status, say);
  const spoken = useCalm(words, old > 0 || !status?.running);
  if (!status)
    return (
      <section id="state" class="state" data-mood="unknown">
        <p class="sentence" role="status">{say("link.connecting")} …</p>
        {model.refusal !== "" && <p class="lost" role="alert" lang="en">{model.refusal}</p>}
      </section>
    );
  const shown: Mood = old > 0 ? "unknown" : mood(status);
  const seen_s = Math.max(0, now - (model.seen ?? now)) / 1000;
  const moves: Motion = old > 0 ? "unknown" : motion(status);
  return (
    <section id="state" class="state" data-mood={shown} data-old={old > 0}>
      <p class="motion" data-motion={moves}>
        <span aria-hidden="true">{MARKS[moves]}</span>{" "}
        {near_words(old > 0 ? null : status, now_ms() / 1000, say, fmt)}
        {old === 0 && <small> {motion_words(status, seen_s, say, fmt)}</small>}
      </p>
      {old === 0 && <Held status={status} />}
      <p class="sentence">{words}</p>
      {status.busy_left_s !== null && old === 0 && <p class="paused" role="alert">{say("busy.waiting", { left: fmt.duration(status.busy_left_s) })}</p>}
      {old === 0 && ((status.phase === "aborted" && !status.failure) || status.interrupted) && <p>{say("aborted.do", { then: then_words(status, say) })}</p>}
      {old === 0 && status.session > 0 && <Progress status={status} touches={model.touches} plan={plan} />}
      <p class="unseen" role="status" aria-live="polite">{spoken}</p>
      {old > 0 && (
        <div class="lost" role="alert">
          <p>
            <strong>{say("link.lost", { age: fmt.duration(old / 1000) })}</strong> {say("link.lost.do")}
          </p>
          <p>{say("link.last", { state: sentence(status, say) })}</p>
        </div>
      )}
      {old === 0 && status.phase === "done" && status.outcome && (
        <>
          <OutcomeLine outcome={status.outcome} />
          {why !== "" && <p>{why}</p>}
          <Details status={status} outcome={status.outcome} />
        </>
      )}
      {old === 0 && <Waiting status={status} />}
    </section>
  );
}

/** Why no scheduled session begins, and who releases it. */
function Held({ status }: { status: Status }) {
  const { say } = useVoice();
  const held = status.schedule?.held ?? "";
  const [told, lang] = useTranslated(status, held !== "");
  return held === "" ? null : <p><strong>{say("schedule")}:</strong> <span lang={lang}>{told.schedule?.held || held}</span></p>;
}

/** `why_ended`: of a session with a goal, whether that was reached, and what to do where not. */
function Details({ status, outcome }: { status: Status; outcome: Outcome }) {
  const { say } = useVoice();
  const [told, lang] = useTranslated(status, true);
  return (
    <>
      {told.why_ended !== "" && <p>{say("u95")}: <span lang={lang}>{told.why_ended}</span></p>}
      <OutcomeDetails outcome={told.outcome ?? outcome} lang={lang} />
    </>
  );
}

function Waiting({ status }: { status: Status }) {
  const { say, fmt } = useVoice();
  const { waiting } = status;
  const [told, lang] = useTranslated(status, waiting !== null && waiting.start !== "");
  if (!waiting || (!waiting.robot && !waiting.contact)) return null;
  const key = waiting.robot && waiting.contact ? "waiting.both"
    : waiting.robot ? "waiting.robot" : "waiting.contact";
  return (
    <div class="waiting">
      <p>{say(key, { left: fmt.duration(waiting.left_s) })}</p>
      {waiting.robot && waiting.start !== "" && (
        <p><strong>{say("failure.todo")}: <span lang={lang}>{told.waiting?.start || waiting.start}</span></strong></p>
      )}
      {waiting.contact && <p>{say("waiting.sensor.do")}</p>}
    </div>
  );
}
