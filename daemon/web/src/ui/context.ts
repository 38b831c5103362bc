// Context shared by all parts of the page.

import { createContext } from "preact";
import { useContext, useEffect, useRef, useState } from "preact/hooks";
import * as decode from "../decode";
import { formats, type Formats } from "../format";
import { asking, get, is_unanswered } from "../request";
import type { Status } from "../types";
import { speaker, type Language, type Say } from "../words";

export interface Voice {
  say: Say;
  fmt: Formats;
  language: Language;
  /** Active colours; charts redraw on changes. */
  theme: "light" | "dark";
}

export const voice_in = (language: Language, theme: Voice["theme"]): Voice => ({
  say: speaker(language), fmt: formats(language), language, theme,
});

export const VoiceContext = createContext<Voice>(voice_in("en", "light"));
export const useVoice = (): Voice => useContext(VoiceContext);

/** clearance.ts; of the newest status. */
export const SituationContext = createContext("");

let awaited = 0;
/** Number of parts of the page that have had no answer yet. */
export const answers_awaited = (): number => awaited;

/**
 * Content of a path; fetched again when `key` changes, and until the daemon answers. Null where it does not exist, and until the
 * first answer; that of before where the daemon is busy or gone.
 */
export function useFetched<T>(path: string | null, key: unknown, decode: (value: unknown) => T | null): T | null {
  const [value, become] = useState<T | null>(null);
  const asked_before = useRef(false);
  useEffect(() => {
    if (path === null) {
      become(null);
      return undefined;
    }
    let first = !asked_before.current;
    asked_before.current = true;
    if (first) ++awaited;
    const settled = () => {
      if (first) --awaited;
      first = false;
    };
    const end = asking(() => get(path), (answer) => {
      settled();
      if (!is_unanswered(answer)) become(answer.status === 200 ? decode(answer.value) : null);
    });
    return () => {
      end();
      settled();
    };
  }, [path, key]);
  return value;
}

/** The status with its sentences in the page's language where `wanted`, and that language; events are in English. */
export function useTranslated(status: Status, wanted: boolean): [Status, Language] {
  const { language } = useVoice();
  const asked = wanted && language !== "en" ? `/v1/status?language=${language}` : null;
  const told = useFetched(asked, status.seq, decode.status);
  return told ? [told, language] : [status, "en"];
}

/** Of a sentence told in `language`. A text that no catalogue has, as of a device or of the planner, is English in each. */
export function language_of(words: string, english: string, language: Language): Language {
  const parts = english.replace(/'cellcal [^']*'/g, "").split(/[.:;] /).filter((part) => part.split(" ").length > 3);
  return words === english || parts.some((part) => words.includes(part)) ? "en" : language;
}
