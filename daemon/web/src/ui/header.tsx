// Names of cell and robot, state of the connection, language and colours.

import { age_ms, type Model } from "../model";
import type { Language } from "../words";
import { Choices } from "./choices";
import { useVoice } from "./context";
import type { Choice } from "./theme";

/** `sign_out`: null where that is not offered. */
export function Header({ model, cell, robot, now, choice, choose, speak, sign_out }: {
  model: Model; cell: string; robot: string; now: number; choice: Choice; choose: (choice: Choice) => void;
  speak: (language: Language) => void; sign_out: (() => void) | null;
}) {
  const { say, fmt } = useVoice();
  const old = age_ms(model, now);
  const link = model.seen === null ? "connecting" : old > 0 ? "old" : "live";
  const words = model.link === "login" ? say("login.title") : say(`link.${link}`, { age: fmt.duration(old / 1000) });
  return (
    <header>
      <a class="skip" href="#state">{say("skip")}</a>
      <h1>{cell || say("title")}</h1>
      {robot !== "" && <span class="robot">{robot}</span>}
      <span class="link" data-link={link}>
        <span aria-hidden="true">{link === "live" ? "●" : "○"}</span>{" "}
        {words}
      </span>
      <Choices choice={choice} choose={choose} speak={speak} />
      {sign_out && <button type="button" class="small leave" onClick={sign_out}>{say("logout")}</button>}
    </header>
  );
}
