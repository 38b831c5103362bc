// Keys to words, in the language that is chosen.

import { de } from "./de";
import { en, type Catalogue, type Key } from "./en";

export type { Key } from "./en";
export type Language = "en" | "de";
export type Values = Record<string, string | number>;
export type Say = (key: Key, values?: Values) => string;

export const CATALOGUES: Record<Language, Catalogue> = { en, de };
export const LANGUAGE_NAMES: Record<Language, string> = { en: "English", de: "Deutsch" };

export function speaker(language: Language): Say {
  const catalogue = CATALOGUES[language];
  return (key, values = {}) =>
    catalogue[key].replace(/\{(\w+)\}/g, (_, name: string) => String(values[name] ?? ""));
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
