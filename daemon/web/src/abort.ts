// Button that stops the arm. A separate program without libraries, independent of the rest of the page, so that it works when the
// page does not. Without scripts the form itself is sent.

import { keep_language, preferred_language, speaker, type Key } from "./words";

const LONGEST_MS = 4000;
const TRIES = 3;
/** Successes are shown briefly, errors until no session runs any more. */
const SHOWN_MS = 8000;

const form = document.getElementById("abort") as HTMLFormElement;
const button = document.getElementById("abort-button") as HTMLButtonElement;
const hint = document.getElementById("abort-hint") as HTMLElement;
const answer = document.getElementById("abort-answer") as HTMLElement;

/** The button is small only as long as the page repeats that nothing moves. */
const STILL_MS = 3000;

let enlarging: ReturnType<typeof setTimeout> | undefined;
let language = preferred_language();
let said: Key | null = null;
let forgetting: ReturnType<typeof setTimeout> | undefined;

function write(): void {
  const say = speaker(language);
  button.textContent = say("abort");
  hint.textContent = say("abort.hint");
  answer.textContent = said ? say(said) : "";
}

function tell(key: Key, alarming = false): void {
  said = key;
  form.dataset.alarm = String(alarming);
  clearTimeout(forgetting);
  if (!alarming && key !== "abort.sending") forgetting = setTimeout(forget, SHOWN_MS);
  write();
}

function forget(): void {
  said = null;
  form.dataset.alarm = "false";
  write();
}

async function send(): Promise<number> {
  const limit = new AbortController();
  const timer = setTimeout(() => limit.abort(), LONGEST_MS);
  try {
    return (await fetch("/v1/abort", { method: "POST", signal: limit.signal })).status;
  } catch {
    return 0;
  } finally {
    clearTimeout(timer);
  }
}

async function abort(): Promise<void> {
  tell("abort.sending");
  let status = 0;
  for (let i = 0; i < TRIES && (status === 0 || status >= 500); ++i) status = await send();
  if (status >= 200 && status < 300) tell("abort.sent");
  else if (status === 409) tell("abort.nothing");
  else if (status === 401 || status === 403) tell("abort.refused", true);
  else tell("abort.failed", true);
}

form.addEventListener("submit", (event) => {
  event.preventDefault();
  void abort();
  dispatchEvent(new CustomEvent("cellcal-abort")); // calls off a start that is not sent yet
});
addEventListener("cellcal-language", (event) => {
  language = (event as CustomEvent<typeof language>).detail;
  keep_language(language);
  document.documentElement.lang = language;
  write();
});
// Earlier answers are obsolete once the page knows whether a session runs.
addEventListener("cellcal-running", (event) => {
  const runs = (event as CustomEvent<boolean>).detail;
  if (runs) form.dataset.small = "false";
  if (runs ? said === "abort.nothing" : form.dataset.alarm === "true") forget();
});
addEventListener("cellcal-still", () => {
  form.dataset.small = "true";
  clearTimeout(enlarging);
  enlarging = setTimeout(() => { form.dataset.small = "false"; }, STILL_MS);
});
document.documentElement.lang = language;
write();
