// The complete page.

import { useCallback, useEffect, useMemo, useReducer, useRef, useState } from "preact/hooks";
import { situation } from "../clearance";
import { now_ms } from "../clock";
import * as decode from "../decode";
import { Live } from "../live";
import { age_ms } from "../model";
import { post } from "../request";
import { is_at_touch, may_move, mood, sentence } from "../sentence";
import { cell_name, now_of, standing_line } from "../standing";
import { preferred_language, type Language } from "../words";
import { CellPanel } from "./cell";
import { CellDialog } from "./cell_form";
import { SituationContext, VoiceContext, answers_awaited, useFetched, voice_in } from "./context";
import { DoctorPanel, useDoctor } from "./doctor";
import { Checks } from "./checks";
import { Drift } from "./drift";
import { FailurePanel } from "./failure";
import { GuidePanel } from "./guide";
import { Header } from "./header";
import { History } from "./history";
import { LinksPanel } from "./links";
import { Login } from "./login";
import { Plots } from "./plots";
import { Proposals } from "./proposals";
import { Accuracy, Residuals } from "./residuals";
import { ResultPanel } from "./result";
import { Standing } from "./standing";
import { StartButtons } from "./start";
import { StatePanel } from "./state";
import { useTheme } from "./theme";
import { Versions } from "./versions";

const TICK_MS = 500;
/** The plant's proposals, a calibration that others put into use: without a session. */
const OTHERS_MS = 60_000;
/** The age of a check changes without a session. */
const STANDING_MS = 300_000;
/** The parts below the state wait so long for each other, so that none pushes another one away. */
const TOGETHER_MS = 3000;
const LICENCES = document.querySelector<HTMLLinkElement>('link[rel="license"]')?.href;

export function App() {
  const [, redraw] = useReducer((n: number) => n + 1, 0);
  const live = useMemo(() => new Live(() => redraw(undefined)), []);
  const [language, set_language] = useState<Language>(preferred_language);
  const { choice, theme, choose } = useTheme();
  const [chosen, show] = useState<number | null>(null);
  useEffect(() => {
    live.begin();
    const ticking = setInterval(() => redraw(undefined), TICK_MS);
    return () => clearInterval(ticking);
  }, []);

  const now = performance.now();
  const { model } = live;
  const { status } = model;
  const old = age_ms(model, now) > 0;
  const voice = useMemo(() => voice_in(language, theme), [language, theme]);
  const { say } = voice;

  const session = status?.session ?? 0;
  const with_login = model.link === "login";
  const asked = with_login || !status ? null : "";
  // Not on each phase of a touch: data of ended sessions are fetched when one has ended.
  const ended = `${session} ${status?.running} ${status?.running ? "" : status?.phase}`;
  // With touches chosen one by one, the plan contains the newest chosen touch only.
  const chosen_as_it_goes = status && (status.goal_mm !== null || status.finding) ? `${status.touches} ${is_at_touch(status)}` : "";
  const planned = status?.running ? `${session} ${status.planned} ${chosen_as_it_goes}` : ended;
  const [said, said_one_more] = useReducer((n: number) => n + 1, 0);
  const said_something = useCallback(() => said_one_more(undefined), []);
  const aged = Math.floor(now / STANDING_MS), others = Math.floor(now / OTHERS_MS);
  const me = useFetched(asked === null ? null : "/v1/me", with_login, decode.role);
  const scene = useFetched(asked === null ? null : "/v1/scene", session, decode.scene);
  const plan = useFetched(session > 0 && asked !== null ? `/v1/sessions/${session}/plan` : null, planned, decode.plan) ?? NOTHING;
  const sessions = useFetched(asked === null ? null : "/v1/sessions", `${ended} ${others}`, decode.sessions);
  const drift = useFetched(asked === null ? null : `/v1/drift?language=${language}`, `${ended} ${said} ${aged}`, decode.drift);
  const versions = useFetched(asked === null ? null : "/v1/versions", `${ended} ${said} ${others}`, decode.versions);
  const proposals = useFetched(asked === null ? null : "/v1/proposals", `${ended} ${said} ${others}`, decode.proposals);

  const in_use = versions?.find((one) => one.active && one.trouble === "")?.session ?? null;
  const in_use_before = useRef(in_use);
  useEffect(() => {
    if (in_use_before.current !== null && in_use_before.current !== in_use) said_something(); // another chart
    in_use_before.current = in_use;
  }, [in_use]);

  // What is typed outlives a lost connection.
  const [entered, enter] = useState<string | null>(null);
  const [looked, look_again] = useReducer((n: number) => n + 1, 0);
  const doctor = useDoctor(asked !== null, `${ended} ${looked}`, language);
  const seen = `${ended} ${looked} ${doctor?.running} ${doctor?.ended} ${aged}`;
  const readiness = useFetched(asked === null ? null : `/v1/readiness?language=${language}`, seen, decode.readiness);
  const together = useRef(false);
  together.current ||=
    (versions !== null && sessions !== null && readiness !== null && answers_awaited() === 0) || now > TOGETHER_MS;
  const idle = status !== null && !old && !status.running;
  const may = idle && me !== null && me !== "look";

  const shown = chosen ?? (status?.phase === "done" ? session : null);
  const figures = useFetched(shown === null || asked === null ? null : `/v1/sessions/${shown}/figures?language=${language}`, ended, decode.figures);

  const why = (shown === session && figures?.result?.findings.find((one) => one.severity === "withholds")?.words) || "";

  const file = (status?.session ? sessions?.find((one) => one.id === status.session)?.cell : "") || readiness?.cell || sessions?.[0]?.cell || "";
  const cell = cell_name(file), robot = scene?.robot || readiness?.robot || "";
  const moment = now_of(status, old);
  const standing = standing_line({ drift, versions, readiness, cell: file, now: moment }, now_ms() / 1000, voice.say, voice.fmt);
  const names = [cell, robot].filter((one) => one !== "").join(", ") || say("title");
  // The page's first button: that of the first line, else that of the guide. A failed or aborted session is looked at first.
  const due = standing.action !== null && standing.state !== "holds";
  const guided = idle && !due && readiness?.next != null && moment !== "amiss";
  const state = !status ? "" : old ? say("link.unknown") : status.running || status.phase === "failed" ? sentence(status, say) : standing.headline;
  const title = state === "" ? names : `${names} · ${state}`;
  useEffect(() => { document.title = title; }, [title]);
  const runs = status === null || old ? null : status.running;
  useEffect(() => {
    if (runs !== null) dispatchEvent(new CustomEvent("cellcal-running", { detail: runs }));
  }, [runs]);
  useEffect(() => {
    if (status && !old && !may_move(status)) dispatchEvent(new CustomEvent("cellcal-still"));
  });
  const speak = (wanted: Language) => {
    set_language(wanted);
    dispatchEvent(new CustomEvent("cellcal-language", { detail: wanted }));
  };
  const sign_out = async () => {
    await post("/v1/logout");
    await live.ask();
  };
  // Not in mid-session: whoever is signed out cannot abort it.
  const may_leave = status !== null && !old && me !== null && (me === "look" || !status.running);
  return (
    <VoiceContext.Provider value={voice}><SituationContext.Provider value={situation(model, now)}>
      <Header model={model} cell={cell} robot={robot} now={now} choice={choice} choose={choose} speak={speak}
              sign_out={may_leave ? () => void sign_out() : null} />
      {with_login ? <main>{entered === null && <Login done={() => void live.ask()} />}</main> : (
        <main data-mood={status && !old ? mood(status) : "unknown"}>
          {status && (
            <Standing line={standing} cell={drift?.checks?.cell || file} may={may} small={status.running} old={age_ms(model, now)}
                      started={() => void live.ask()} />
          )}
          {(status || together.current) && <div class="top">
            <StatePanel model={model} plan={plan} now={now} why={why} />
            {status && !old && <StartButtons status={status} role={me} second={guided || due} started={() => void live.ask()} sign_out={() => void sign_out()}
                                             last_cell={file} />}
          </div>}
          {status && !old && <FailurePanel status={status} />}
          {together.current && idle && readiness && (
            <GuidePanel readiness={readiness} may={may} looking={doctor?.running === true}
                        quiet={!guided} enter={() => enter(readiness.cell)} again={() => look_again(undefined)}
                        begun={() => look_again(undefined)} started={() => void live.ask()} />
          )}
          {together.current && proposals && !old && <Proposals seen={proposals} may={may} changed={said_something} />}
          {together.current && <div class="grid">
            <div class="column">
              <CellPanel model={model} scene={scene} plan={plan} now={now} nothing={sessions?.length === 0} />
              {session > 0 && status?.phase !== "done" && <Residuals touches={model.touches} found={false} old={old} />}
              {figures && <ResultPanel figures={figures} />}
            </div>
            <div class="column first">
              {status && <Accuracy touches={model.touches} status={status} old={old} />}
              <LinksPanel status={status} old={old} />
              {doctor && <DoctorPanel doctor={doctor} readiness={readiness} cell={file} may={may} begun={() => look_again(undefined)} />}
              {figures?.result && <Residuals touches={figures.touches} found />}
            </div>
            {sessions && <History sessions={sessions} shown={shown} show={show} />}
            {versions && versions.length > 0 && <Versions versions={versions} may={may} changed={said_something} />}
            {in_use !== null && <Plots session={in_use} />}
            {drift?.checks && <Checks chart={drift.checks} controller={drift.controller} />}
            <Drift rows={drift?.sessions ?? NOTHING} />
          </div>}
        </main>
      )}
      {entered !== null && (
        <CellDialog cell={entered} sign_in={with_login ? <Login done={() => void live.ask()} /> : null}
                    close={() => enter(null)} done={() => { enter(null); look_again(undefined); }} />
      )}
      <footer class="note">
        {status?.version && `cellcald ${status.version} · `}<a href={LICENCES}>{say("licences")}</a>
      </footer>
    </SituationContext.Provider></VoiceContext.Provider>
  );
}

const NOTHING: never[] = [];
