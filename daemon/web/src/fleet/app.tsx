// All cells of the plants, those that need attention first. Read-only.

import { useEffect, useMemo, useReducer, useState } from "preact/hooks";
import { get } from "../request";
import { Choices } from "../ui/choices";
import { VoiceContext, voice_in } from "../ui/context";
import { useTheme } from "../ui/theme";
import { keep_language, preferred_language, type Language } from "../words";
import { CellDetail } from "./cell";
import { CellTable } from "./cells";
import { Compare } from "./compare";
import * as decode from "./decode";
import type { FleetCell } from "../../generated/api";

const ASK_MS = 10_000, OLD_MS = 30_000, TICK_MS = 1000;

export function FleetApp() {
  const [, redraw] = useReducer((n: number) => n + 1, 0);
  const [language, set_language] = useState<Language>(preferred_language);
  const { choice, theme, choose } = useTheme();
  const voice = useMemo(() => voice_in(language, theme), [language, theme]);
  const { say, fmt } = voice;
  const [cells, become] = useState<FleetCell[] | null>(null);
  const [seen, set_seen] = useState<number | null>(null);
  const [wrong, set_wrong] = useState("");
  const [chosen, choose_cell] = useState<string | null>(null);
  useEffect(() => {
    let wanted = true;
    const ask = async () => {
      const answer = await get("/v1/fleet/cells");
      if (!wanted) return;
      const all = answer.status === 200 ? decode.cells(answer.value) : null;
      set_wrong(all ? "" : answer.words || voice.say("fleet.no-answer"));
      if (!all) return;
      become(all);
      set_seen(performance.now());
    };
    void ask();
    const asking = setInterval(() => void ask(), ASK_MS), ticking = setInterval(() => redraw(undefined), TICK_MS);
    return () => {
      wanted = false;
      clearInterval(asking);
      clearInterval(ticking);
    };
  }, [voice]);
  const age = seen === null ? null : performance.now() - seen;
  const old = age === null || age > OLD_MS;
  const needing = cells?.filter((one) => one.needs.length > 0).length ?? 0;
  const sentence = cells === null ? say("fleet.asking")
    : cells.length === 0 ? say("fleet.none")
    : needing === 0 ? say("fleet.all-well", { n: cells.length }) : say("fleet.needing", { n: needing, all: cells.length });
  const title = `${old && cells !== null ? say("fleet.unknown") : sentence} · ${say("fleet.title")}`;
  useEffect(() => { document.title = title; }, [title]);
  const speak = (wanted: Language) => {
    set_language(wanted);
    keep_language(wanted);
    document.documentElement.lang = wanted;
  };
  const open = cells?.find((one) => `${one.plant}/${one.cell}` === chosen) ?? null;
  return (
    <VoiceContext.Provider value={voice}>
      <header>
        <h1>{say("fleet.title")}</h1>
        <span class="link" data-link={old ? "old" : "live"}>
          <span aria-hidden="true">{old ? "○" : "●"}</span> {seen === null ? say("fleet.asking") : say("fleet.age", { age: fmt.duration((age ?? 0) / 1000) })}
        </span>
        <Choices choice={choice} choose={choose} speak={speak} />
      </header>
      <main data-mood={old ? "unknown" : needing > 0 ? "wait" : "good"}>
        <section class="panel" aria-labelledby="fleet-state">
          <p id="fleet-state" class="sentence" role="status">{old && cells !== null ? say("fleet.unknown") : sentence}</p>
          {wrong !== "" && <p class="refused">{wrong}</p>}
        </section>
        {cells && cells.length > 0 && (
          <CellTable cells={cells} old={old} chosen={chosen} choose={choose_cell} />
        )}
        {open && <CellDetail key={chosen} cell={open} old={old} />}
        {cells && cells.length > 0 && <Compare cells={cells} />}
      </main>
    </VoiceContext.Provider>
  );
}
