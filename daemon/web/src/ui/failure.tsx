// Failure of a session and its remedy.

import * as decode from "../decode";
import { then_words } from "../sentence";
import type { Status } from "../types";
import { useFetched, useVoice } from "./context";

export function FailurePanel({ status }: { status: Status }) {
  const { say, language } = useVoice();
  const { failure } = status;
  // Events are in English.
  const asked = failure && language !== "en" ? `/v1/status?language=${language}` : null;
  const told = useFetched(asked, status.seq, decode.status)?.failure;
  if (!failure) return null;
  return (
    <section class="panel failure" aria-labelledby="failure-title">
      <h2 id="failure-title">{say("failure")}</h2>
      <p class="what"><span aria-hidden="true">✖ </span>{say(`failure.${failure.kind}`)}</p>
      <p class="todo"><strong>{say("failure.todo")}:</strong> {say(`do.${failure.kind}`, { then: then_words(status, say) })}</p>
      {failure.detail !== "" && (
        <p class="evidence"><strong>{say("failure.detail")}:</strong> <span lang={told ? language : "en"}>{told?.detail ?? failure.detail}</span></p>
      )}
    </section>
  );
}
