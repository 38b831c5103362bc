// Context shared by all parts of the page.

import { createContext } from "preact";
import { useContext, useEffect, useRef, useState } from "preact/hooks";
import { formats, type Formats } from "../format";
import { get } from "../request";
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

const TRIES = 5, AGAIN_MS = 2000, BUSY = 503, SILENT = 0;

let awaited = 0;
/** Number of parts of the page that have had no answer yet. */
export const answers_awaited = (): number => awaited;

/**
 * Content of a path; fetched again when `key` changes, when the daemon was busy, and until it answers. Null until then, and where
 * it does not exist; that of the path before where the daemon is gone.
 */
export function useFetched<T>(path: string | null, key: unknown, decode: (value: unknown) => T | null): T | null {
  const [value, become] = useState<T | null>(null);
  const asked_before = useRef(false);
  useEffect(() => {
    let first = path !== null && !asked_before.current;
    asked_before.current ||= first;
    if (first) ++awaited;
    const answered = () => {
      if (first) --awaited;
      first = false;
    };
    let wanted = true, timer: ReturnType<typeof setTimeout> | undefined;
    const ask = (asked: string, left: number) => void get(asked).then((answer) => {
      if (!wanted) return;
      answered();
      if (answer.status !== SILENT) become(answer.status === 200 ? decode(answer.value) : null);
      if (answer.status === SILENT) timer = setTimeout(() => ask(asked, left), AGAIN_MS);
      if (answer.status === BUSY && left > 1) timer = setTimeout(() => ask(asked, left - 1), AGAIN_MS);
    });
    if (path === null) become(null);
    else ask(path, TRIES);
    return () => {
      wanted = false;
      answered();
      clearTimeout(timer);
    };
  }, [path, key]);
  return value;
}
