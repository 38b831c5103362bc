// Language and colours.

import { CATALOGUES, speaker, type Language } from "../words";
import { useVoice } from "./context";
import { CHOICES, type Choice } from "./theme";

export function Choices({ choice, choose, speak }: {
  choice: Choice; choose: (choice: Choice) => void; speak: (language: Language) => void;
}) {
  const { say, language } = useVoice();
  return (
    <span class="choices">
      <label>
        <span class="quiet">{say("language")}</span>
        <select name="language" value={language}
                onChange={(event) => speak(event.currentTarget.value)}>
          {Object.keys(CATALOGUES).map((one) => (
            <option key={one} value={one} lang={one}>{speaker(one)("language.name")}</option>
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
  );
}
