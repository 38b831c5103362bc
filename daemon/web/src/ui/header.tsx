// Title, how alive the connection is, language and colours.

import { age_ms, type Model } from "../model";
import { CATALOGUES, LANGUAGE_NAMES, type Language } from "../words";
import { useVoice } from "./context";
import { CHOICES, type Choice } from "./theme";

export function Header({ model, now, choice, choose, speak }: {
  model: Model; now: number; choice: Choice; choose: (choice: Choice) => void;
  speak: (language: Language) => void;
}) {
  const { say, fmt, language } = useVoice();
  const old = age_ms(model, now);
  const link = model.seen === null ? "connecting" : old > 0 ? "old" : "live";
  const words = model.link === "login" ? say("login.title") : say(`link.${link}`, { age: fmt.duration(old / 1000) });
  return (
    <header>
      <a class="skip" href="#state">{say("skip")}</a>
      <h1>{say("title")}</h1>
      <span class="link" data-link={link}>
        <span aria-hidden="true">{link === "live" ? "●" : "○"}</span>{" "}
        {words}
      </span>
      <span class="choices">
        <label>
          <span class="quiet">{say("language")}</span>
          <select name="language" value={language}
                  onChange={(event) => speak(event.currentTarget.value as Language)}>
            {(Object.keys(CATALOGUES) as Language[]).map((one) => (
              <option key={one} value={one} lang={one}>{LANGUAGE_NAMES[one]}</option>
            ))}
          </select>
        </label>
        <label>
          <span class="quiet">{say("theme")}</span>
          <select name="theme" value={choice}
                  onChange={(event) => choose(event.currentTarget.value as Choice)}>
            {CHOICES.map((one) => <option key={one} value={one}>{say(`theme.${one}`)}</option>)}
          </select>
        </label>
      </span>
    </header>
  );
}
