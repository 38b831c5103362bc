// Failure of a session and its remedy.

import { then_words } from "../sentence";
import type { Status } from "../types";
import { language_of, useTranslated, useVoice } from "./context";

export function FailurePanel({ status }: { status: Status }) {
  const { say } = useVoice();
  const { failure } = status;
  const [told, language] = useTranslated(status, failure !== null);
  if (!failure) return null;
  const lang = language_of(told.failure?.detail || failure.detail, failure.detail, language);
  const detail = lang === "en" ? failure.detail : told.failure?.detail;
  return (
    <section class="panel failure" aria-labelledby="failure-title">
      <h2 id="failure-title">{say("failure")}</h2>
      <p class="what"><span aria-hidden="true">✖ </span>{say(`failure.${failure.kind}`)}</p>
      <p class="todo"><strong>{say("failure.todo")}:</strong> {say(`do.${failure.kind}`, { then: then_words(status, say) })}</p>
      {failure.detail !== "" && (
        <p class="evidence"><strong>{say("failure.detail")}:</strong> <span lang={lang}>{detail}</span></p>
      )}
    </section>
  );
}
