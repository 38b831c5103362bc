// Keys to words, in the language that is chosen: one JSON catalogue per language, shared with the programs
// (calib/words), whose own sentences begin with "say." and are left out of the page. {name} stands for a value. A sentence
// with ".one" behind its key replaces that of the key where {n} is 1.

import catalogues from "catalogues";
import type en from "./en.json";

export type Key = Exclude<keyof typeof en, `say.${string}`>;
export type Catalogue = Record<Key, string>;
/** Name of its file. */
export type Language = string;
export type Values = Record<string, string | number>;
export type Say = (key: Key, values?: Values) => string;

export const CATALOGUES = catalogues as Record<Language, Catalogue> & { en: Catalogue };

export function speaker(language: Language): Say {
  const catalogue = CATALOGUES[language] ?? CATALOGUES.en;
  return (key, values = {}) => {
    const one = values.n === 1 ? catalogue[`${key}.one` as Key] : undefined;
    // A value may end with a full stop of its own: "11. Dez.".
    return (one ?? catalogue[key]).replace(/\{(\w+)\}(\.?)/g, (_, name: string, stop: string) => {
      const value = String(values[name] ?? "");
      return value.endsWith(".") ? value : value + stop;
    });
  };
}

/** Of a word that another version may have made; as it is where the catalogue has none. */
export const named = (say: Say, key: string): string =>
  key in CATALOGUES.en ? say(key as Key) : key.slice(key.lastIndexOf(".") + 1);

const STORED = "cellcal.language";

export function preferred_language(): Language {
  let stored: string | null = null;
  try {
    stored = localStorage.getItem(STORED);
  } catch {
    // A browser that keeps nothing: its own language then.
  }
  const own = navigator.language.toLowerCase().split("-")[0] ?? "";
  return [stored, own].find((one) => one !== null && one in CATALOGUES) ?? "en";
}

export function keep_language(language: Language): void {
  try {
    localStorage.setItem(STORED, language);
  } catch {
    // Then it is chosen again next time.
  }
}
