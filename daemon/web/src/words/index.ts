// Keys to words, in the language that is chosen: one JSON catalogue per language; daemon/unattended reads them as well.
// {name} stands for a value.

import de from "./de.json";
import en from "./en.json";

export type Key = keyof typeof en;
export type Catalogue = Record<Key, string>;
export type Language = "en" | "de";
export type Values = Record<string, string | number>;
export type Say = (key: Key, values?: Values) => string;

export const CATALOGUES: Record<Language, Catalogue> = { en, de };
export const LANGUAGE_NAMES: Record<Language, string> = { en: "English", de: "Deutsch" };

export function speaker(language: Language): Say {
  const catalogue = CATALOGUES[language];
  return (key, values = {}) =>
    // A value may end with a full stop of its own: "11. Dez.".
    catalogue[key].replace(/\{(\w+)\}(\.?)/g, (_, name: string, stop: string) => {
      const value = String(values[name] ?? "");
      return value.endsWith(".") ? value : value + stop;
    });
}

const STORED = "cellcal.language";

export function preferred_language(): Language {
  let stored: string | null = null;
  try {
    stored = localStorage.getItem(STORED);
  } catch {
    // A browser that keeps nothing: its own language then.
  }
  if (stored === "en" || stored === "de") return stored;
  return navigator.language.toLowerCase().startsWith("de") ? "de" : "en";
}

export function keep_language(language: Language): void {
  try {
    localStorage.setItem(STORED, language);
  } catch {
    // Then it is chosen again next time.
  }
}
