// Light or dark theme: system setting, or chosen here.

import { useEffect, useState } from "preact/hooks";

export const CHOICES = ["auto", "light", "dark"] as const;
export type Choice = (typeof CHOICES)[number];

const STORED = "cellcal.theme";
const DARK = "(prefers-color-scheme: dark)";

function stored(): Choice {
  try {
    return CHOICES.find((one) => one === localStorage.getItem(STORED)) ?? "auto";
  } catch {
    return "auto"; // the browser stores nothing
  }
}

export function useTheme(): { choice: Choice; theme: "light" | "dark"; choose: (choice: Choice) => void } {
  const [choice, become] = useState<Choice>(stored);
  const [system_is_dark, set_system] = useState(() => matchMedia(DARK).matches);
  useEffect(() => {
    const media = matchMedia(DARK);
    const look = () => set_system(media.matches);
    media.addEventListener("change", look);
    return () => media.removeEventListener("change", look);
  }, []);
  const theme = choice === "auto" ? (system_is_dark ? "dark" : "light") : choice;
  // Before the children render in these colours.
  document.documentElement.dataset.theme = theme;
  const choose = (wanted: Choice) => {
    become(wanted);
    try {
      localStorage.setItem(STORED, wanted);
    } catch {
      // chosen again on the next visit
    }
  };
  return { choice, theme, choose };
}
