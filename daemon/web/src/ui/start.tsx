// Starting and resuming sessions. Both move the arm and require the confirmation that the cell is clear.

import type { ComponentChildren } from "preact";
import { useContext, useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";
import { begin, counts, type Clearance, type Start } from "../clearance";
import { NOT_REFUSED } from "../request";
import { left_after, resumable } from "../sentence";
import type { Kind, Role, Status } from "../types";
import { SituationContext, useVoice } from "./context";
import { useDialog } from "./dialog";
import { Refused } from "./refused";

/** Kinds that can be started here: `update` is a calibration on top of the last one, by which the TCP is measured. */
const WISHES = ["calibrate", "update", "qualify", "find", "dry-run", "check"] as const satisfies readonly (Kind | "update")[];

export interface Wish {
  kind: (typeof WISHES)[number];
  cell: string;
  touches: string;
  check: string;
  goal: string;
  load: string;
  find: boolean;
}
/** Of the goal, as the attribute "pattern": "0.15", "0,15 mm". */
const LENGTH = "\\s*(\\d+([.,]\\d*)?|[.,]\\d+)\\s*(mm)?\\s*";
/** A full calibration. */
export const WHOLE: Wish = { kind: "calibrate", cell: "", touches: "100", check: "10", goal: "", load: "", find: false };

export function run_request(wish: Wish): Record<string, unknown> {
  const body = request_of_kind(wish);
  return wish.load.trim() === "" ? body : { ...body, load: wish.load.trim() };
}

function request_of_kind(wish: Wish): Record<string, unknown> {
  if (wish.kind === "dry-run")
    return { cell: wish.cell.trim(), kind: wish.kind, touches: Number(wish.touches), check: Number(wish.check) };
  if (wish.kind === "update") return { cell: wish.cell.trim(), update: true };
  if (wish.kind !== "calibrate") return { cell: wish.cell.trim(), kind: wish.kind };
  const body: Record<string, unknown> = { cell: wish.cell.trim(), check: Number(wish.check) };
  if (wish.goal.trim() !== "") body.goal_mm = Number(wish.goal.replace("mm", "").replace(",", "."));
  else body.touches = Number(wish.touches);
  if (wish.find) body.find = true;
  return body;
}

/** `second`: another session is due first. */
export function StartButtons({ status, role, last_cell, second, started, sign_out }: {
  status: Status; role: Role | null; last_cell: string; second: boolean; started: () => void; sign_out: () => void;
}) {
  const { say } = useVoice();
  const [open, become] = useState<"start" | "resume" | null>(null);
  // A dialog that is only hidden would open again by itself, with another choice.
  useEffect(() => { if (status.running) become(null); }, [status.running]);
  if (status.running) return null;
  if (role === "look")
    return (
      <div class="buttons begin">
        <p class="note">{say("role.look")}</p>
        <button type="button" class="small" onClick={sign_out}>{say("logout")}</button>
      </div>
    );
  const left = resumable(status);
  const close = () => become(null);
  const done = () => {
    close();
    started();
  };
  return (
    <div class="buttons begin">
      {left && (
        <button type="button" class="go" onClick={() => become("resume")}>
          {say("resume", { session: left.session })}
        </button>
      )}
      <button type="button" class={left || second ? "" : "go"} onClick={() => become("start")}>{say("start")}</button>
      {open === "start" && <StartDialog last_cell={last_cell} done={done} close={close} />}
      {open === "resume" && left && (
        <ClearDialog title={say("resume.title", left)} go={say("start.resume.go")}
                     body={() => ({ resume: true })} done={done} close={close}>
          <p>{say(left_after(left.total), left)}</p>
        </ClearDialog>
      )}
    </div>
  );
}

export function StartDialog({ last_cell, preset, done, close }: {
  last_cell: string; preset?: Partial<Wish>; done: () => void; close: () => void;
}) {
  const { say } = useVoice();
  const [wish, become] = useState<Wish>({ ...WHOLE, ...preset, cell: last_cell });
  const field = (name: "cell" | "touches" | "check" | "goal" | "load", kind: "text" | "number") => (
    <label>
      {say(`start.${name}`)}
      <input name={name} type={kind} inputMode={name === "goal" ? "decimal" : undefined}
             required={name !== "goal" && name !== "load"} min={name === "touches" ? 4 : 0} max={2000}
             value={wish[name]} placeholder={name === "cell" ? say("start.cell.hint") : undefined}
             disabled={name === "touches" && wish.goal.trim() !== ""}
             pattern={name === "goal" ? LENGTH : undefined} title={name === "goal" ? say("start.goal") : undefined}
             onInput={(event) => become({ ...wish, [name]: event.currentTarget.value })} />
    </label>
  );
  return (
    <ClearDialog title={say("start.title")} go={say("start.go")} body={() => run_request(wish)}
                 done={done} close={close}>
      <label>
        {say("start.kind")}
        <select name="kind" value={wish.kind}
                onChange={(event) => become({ ...wish, kind: event.currentTarget.value as Wish["kind"] })}>
          {WISHES.map((kind) => <option key={kind} value={kind}>{say(`start.kind.${kind}`)}</option>)}
        </select>
      </label>
      {field("cell", "text")}
      {field("load", "text")}
      {wish.kind === "update" && <p class="note">{say("start.update")}</p>}
      {(wish.kind === "calibrate" || wish.kind === "dry-run") && (
        <div class="pair">{field("touches", "number")}{field("check", "number")}</div>
      )}
      {wish.kind === "calibrate" && (
        <>
          {field("goal", "text")}
          <label class="tick">
            <input type="checkbox" name="find" checked={wish.find}
                   onChange={(event) => become({ ...wish, find: event.currentTarget.checked })} />
            {say("start.find")}
          </label>
        </>
      )}
    </ClearDialog>
  );
}

function ClearDialog({ title, go, body, done, close, children }: {
  title: string; go: string; body: () => unknown; done: () => void; close: () => void;
  children: ComponentChildren;
}) {
  const { say } = useVoice();
  const situation = useContext(SituationContext);
  const [given, give] = useState<Clearance | null>(null);
  const [stage, set_stage] = useState<"asks" | "confirms" | "sent">("asks");
  const [refused, set_refused] = useState(NOT_REFUSED);
  const start = useRef<Start>({ called_off: false, sent: false });
  const withdraw = () => {
    start.current.called_off = true;
    give(null);
  };
  const clear = given !== null && counts(given, situation, Date.now());
  useLayoutEffect(() => { if (given && !clear) withdraw(); });
  // Once the request is out, leaving would hide what only an abort stops.
  const leave = () => { if (!start.current.sent) close(); };
  const dialog = useDialog(leave);
  useLayoutEffect(() => {
    addEventListener("cellcal-abort", withdraw);
    return () => {
      removeEventListener("cellcal-abort", withdraw);
      start.current.called_off = true;
    };
  }, []);
  const submit = async (event: Event) => {
    event.preventDefault();
    if (!clear || stage !== "asks") return;
    set_stage("confirms");
    set_refused(NOT_REFUSED);
    start.current = { called_off: false, sent: false };
    const why = await begin(start.current, body(), say, () => set_stage("sent"));
    set_stage("asks");
    set_refused(why);
    give(null);
    if (why.words === "") done();
  };
  return (
    <>
    <div class="veil" onClick={leave} />
    <dialog ref={dialog} aria-labelledby="dialog-title">
      <form onSubmit={submit}>
        <h2 id="dialog-title">{title}</h2>
        {children}
        <label class="tick clear">
          <input type="checkbox" name="clear" checked={clear}
                 onChange={(event) => (event.currentTarget.checked ? give({ situation, given_ms: Date.now() }) : withdraw())} />
          <strong>{say("start.clear")}</strong>
        </label>
        <p class="note">{say("start.clear.hint")}</p>
        <Refused by={refused} />
        {stage === "sent" && <p class="paused" role="alert">{say("start.sent")}</p>}
        <div class="buttons">
          <button type="button" disabled={stage === "sent"} onClick={leave}>{say("cancel")}</button>
          <button type="submit" class="go" disabled={!clear || stage !== "asks"}>{go}</button>
        </div>
      </form>
    </dialog>
    </>
  );
}
