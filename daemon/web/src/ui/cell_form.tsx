// Form for the cell's file: robot, tool, spheres and their certificate, obstacles; typed or from files. The daemon reads and writes
// it; causes no motion.

import type { ComponentChildren, RefObject } from "preact";
import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";
import {
  cell_file, cell_forms, EMPTY, form_answer, form_of, imported, length_drafts, name_within, new_length, new_obstacle, new_sphere, placed, places_wanted,
  refused_field, robot_choice, sphere_drafts, still_missing, taught_angles, unit_seen, vouch, type CellDraft, type CellForms, type MissingFile, type Refused, type SphereDraft, type UnitSeen, type Wrong,
} from "../cell_form";
import { fields, number, words } from "../decode";
import { asking, get, is_good, post, post_file, refusal, type Answer } from "../request";
import type { Key, Say } from "../words";
import { fault_words, FaultsContext, Files, LengthRow, ObstacleRow, SphereRow, TextField, useFault } from "./cell_rows";
import { CellSketch } from "./cell_sketch";
import { useVoice } from "./context";
import { useDialog } from "./dialog";
import { examine } from "./doctor";

const MEGABYTE = 1 << 20;
const LARGEST_FILE = MEGABYTE, LARGEST_MESH = 8 * MEGABYTE;
/** Places are computed within seconds, more on a busy computer. */
const PLACES_MS = 120_000, UPLOAD_MS = 60_000;

/** Forms created here, and the form of `cell` if it was created here; asked for once, while somebody is signed in. */
function useForms(cell: string, signed_out: boolean): { forms: CellForms | null; refused: Answer | null } {
  const [seen, become] = useState<{ forms: CellForms | null; refused: Answer | null }>({ forms: null, refused: null });
  useEffect(() => {
    if (signed_out || seen.forms) return undefined;
    const ask = async () => {
      const answer = await get("/v1/cell-form");
      const name = name_within(cell_forms(answer.value)?.folder ?? "", cell);
      if (cell === "") return answer;
      const asked = name !== "" ? `name=${encodeURIComponent(name)}` : `file=${encodeURIComponent(cell)}`;
      return form_answer(answer, await get(`/v1/cell-form?${asked}`));
    };
    return asking(ask, (answer) => become({ forms: is_good(answer) ? cell_forms(answer.value) : null, refused: is_good(answer) ? null : answer }));
  }, [cell, signed_out]);
  return seen;
}

/** `sign_in`: shown above the form, which keeps what is typed; null: signed in. */
export function CellDialog({ cell, sign_in, done, close }: { cell: string; sign_in: ComponentChildren; done: () => void; close: () => void }) {
  const { say } = useVoice();
  const signed_out = sign_in !== null;
  const { forms, refused } = useForms(cell, signed_out);
  const leave = useRef(close);
  const dialog = useDialog(() => leave.current());
  return (
    <>
      <div class="veil" />
      <dialog ref={dialog} class="wide" aria-labelledby="cell-form-title">
        {sign_in}
        {forms && (forms.shown === null || forms.shown.draft !== null)
          ? <CellFields cell={cell} forms={forms} signed_out={signed_out} done={done} close={close} leave={leave} />
          : (
            <form>
              <h2 id="cell-form-title">{say("cell.title")}</h2>
              {refused && <p class="refused" role="alert">{refusal(refused, say)}</p>}
              {forms?.shown && <p>{say("cell.more", { file: forms.shown.file })}</p>}
              <div class="buttons"><button type="button" onClick={close}>{say("cancel")}</button></div>
            </form>
          )}
      </dialog>
    </>
  );
}

/** Request of an imported robot. */
interface RobotFiles {
  machine_data?: string;
  robcor?: string;
  robot_file?: string;
  unit_speed_mm_s?: number;
}

/** Where the form comes from, and what of it is not shown. */
interface Basis {
  /** Created here: the file is replaced. Any other is left unchanged, and a new one is written. */
  own: boolean;
  file: string;
  sha256: string;
  kept: string[];
  missing: MissingFile[];
  /** Of a file of another computer. */
  text: string;
}
const NEW: Basis = { own: false, file: "", sha256: "", kept: [], missing: [], text: "" };
const basis_of = ({ folder, shown }: CellForms): Basis =>
  shown === null ? NEW : { ...NEW, own: name_within(folder, shown.file) !== "", file: shown.file, sha256: shown.sha256, kept: shown.kept };

type TextKey = "name" | "xyz" | "abc" | "tool_u" | "mass" | "com" | "tip" | "floor" | "certificate" | "date";

/** Rows of the form: changed, removed. */
function edits<R>(rows: R[], become: (rows: R[]) => void, i: number) {
  return {
    change: (change: Partial<R>) => become(rows.map((one, k) => (k === i ? { ...one, ...change } : one))),
    drop: () => become(rows.filter((_, k) => k !== i)),
  };
}

/** Files and positions that the daemon reads into the form. `say_it`: the refusal; empty: none. */
function readers(say: Say, say_it: (words: string) => void, become: (next: (now: CellDraft) => CellDraft) => void) {
  const text_in = async (file: File): Promise<string> => {
    const read = file.size > LARGEST_FILE ? "" : await file.text().catch(() => "");
    if (read === "") say_it(say("cell.csv.none", { file: file.name }));
    return read;
  };
  const asked = async (path: string, body: unknown, longest_ms?: number, told = (answer: Answer) => refusal(answer, say)): Promise<Record<string, unknown> | null> => {
    const answer = await post(path, body, longest_ms);
    say_it(is_good(answer) ? "" : told(answer));
    return is_good(answer) ? fields(answer.value) : null;
  };
  return {
    text_in, asked,
    csv: async (kind: "spheres" | "certificate", file: File | undefined) => {
      const csv = file ? await text_in(file) : "";
      const read = csv === "" ? null : await asked("/v1/cell-form/lists", { [kind]: csv });
      if (!read) return;
      become((now) => imported(now, kind === "spheres" ? { spheres: sphere_drafts(read.spheres) } : { lengths: length_drafts(read.lengths) }));
    },
    position: async (row: number) => {
      const where = taught_angles(await asked("/v1/position", {}));
      if (where === null) return;
      become((now) => ({ ...now, spheres: now.spheres.map((one, k) => (k === row ? { ...one, where } : one)) }));
    },
    mesh: async (row: number, file: File) => {
      if (file.size > LARGEST_MESH) return say_it(say("cell.file.large", { file: file.name }));
      const answer = await post_file("/v1/cell-form/mesh", file, UPLOAD_MS);
      say_it(is_good(answer) ? "" : `${file.name}: ${refusal(answer, say)}`);
      const kept = is_good(answer) ? words(fields(answer.value)?.file) : "";
      if (kept !== "") become((now) => ({ ...now, obstacles: now.obstacles.map((one, k) => (k === row ? { ...one, file: kept } : one)) }));
    },
  };
}

/** Name of a field for the line that sums up its error. */
function wrong_words(wrong: Wrong, say: Say): string {
  if (wrong.field === "robot") return say("cell.wrong.robot");
  return say("cell.wrong", { of: wrong.of || say(wrong.field === "floor" ? "cell.obstacles" : "cell.tool"), field: say(`cell.${wrong.field}` as Key), what: fault_words(wrong, say) });
}

/** `leave`: receives how Escape leaves the form. */
function CellFields({ cell, forms, signed_out, done, close, leave }: {
  cell: string; forms: CellForms; signed_out: boolean; done: () => void; close: () => void; leave: RefObject<() => void>;
}) {
  const { say } = useVoice();
  const [draft, become] = useState<CellDraft>(forms.shown?.draft ?? EMPTY);
  /** As opened. */
  const opened = useRef(draft);
  const [leaving, ask] = useState(false);
  leave.current = () => (draft === opened.current ? close() : ask(!leaving));
  const [robots, set_robots] = useState(forms.robots);
  const [basis, set_basis] = useState<Basis>(() => basis_of(forms));
  const [busy, set_busy] = useState(false);
  const [said, set_said] = useState("");
  /** Errors are shown from the first attempt to write on. */
  const [tried, set_tried] = useState(false);
  const [refused, set_refused] = useState<Refused | null>(null);
  const [unit, set_unit] = useState<{ robot: string; request: RobotFiles; seen: UnitSeen } | null>(null);
  useEffect(() => set_refused(null), [draft]);
  useEffect(() => { if (!signed_out) set_said(""); }, [signed_out]);
  const before = useRef(draft);
  const form = useRef<HTMLFormElement>(null);
  const set = (change: Partial<CellDraft>) => become((now) => ({ ...now, ...change }));
  const read = readers(say, set_said, become);
  const made = form_of(draft);
  const text = (key: TextKey, optional = false) => (
    <TextField label={say(`cell.${key}`)} name={`cell-${key}`} at={`tool.${key}`} optional={optional} value={draft[key]} disabled={key === "name" && basis.own}
               placeholder={key === "date" ? "2026-04-01" : undefined} focused={() => { before.current = draft; }}
               change={(value) => become((now) => (key === "certificate" || key === "date" ? vouch(now, { [key]: value }, before.current) : { ...now, [key]: value }))} />
  );
  const focus = () => requestAnimationFrame(() => form.current?.querySelector<HTMLElement>("[aria-invalid]")?.focus());
  const show = (wrong: Wrong[]) => {
    set_tried(true);
    set_said(wrong[0] ? wrong_words(wrong[0], say) : "");
    focus();
  };
  /** A refusal of the form stands at its field, and here in short; any other in full. */
  const told = (answer: Answer): string => {
    const field = refused_field(answer.value, draft);
    if (!field) return refusal(answer, say);
    set_refused(field);
    focus();
    return say("cell.refused", { field: field.of === "" ? say(field.label) : `${field.of}, ${say(field.label)}` });
  };
  const submit = async (event: Event) => {
    event.preventDefault();
    if (busy) return;
    if ("wrong" in made) return show(made.wrong);
    if (unit?.robot === draft.robot && unit.seen.speed === null) return set_said(say("cell.unit.needed"));
    set_busy(true);
    const { own, file, sha256, text: from_text } = basis;
    const origin = from_text !== "" ? { from_text } : own ? { instead_of: sha256 } : file !== "" ? { from: file } : {};
    const answer = await post("/v1/cell-form", { name: draft.name.trim(), form: made.form, ...origin });
    // The doctor examines it, and the guide refers to the cell examined last.
    const words_ = is_good(answer) ? (await examine(words(fields(answer.value)?.file), say)).words : told(answer);
    set_busy(false);
    set_said(words_);
    if (words_ === "") done();
  };
  const take_robot = async (files: File[]) => {
    const request: RobotFiles = {};
    for (const file of files) {
      const data = await read.text_in(file);
      if (data === "") return;
      request[/\.toml$/i.test(file.name) ? "robot_file" : /robcor/i.test(file.name) ? "robcor" : "machine_data"] = data;
    }
    await import_robot(request);
  };
  const import_robot = async (request: RobotFiles) => {
    const imported = await read.asked("/v1/cell-form/robot", request);
    const robot = robot_choice(imported);
    if (robot === null) return;
    set_robots((now) => [...now.filter((one) => one.name !== robot.name), robot]);
    set({ robot: robot.name });
    const seen = unit_seen(imported);
    set_unit(seen && seen.missing === "" ? { robot: robot.name, request, seen } : null);
    if (seen && seen.missing !== "") set_said(say("cell.robot.unit", { why: seen.missing }));
  };
  const open_file = async (file: File | undefined) => {
    const cell_text = file ? await read.text_in(file) : "";
    const seen = file && cell_text !== "" ? cell_file(file.name, await read.asked("/v1/cell-form/read", { cell: cell_text })) : null;
    if (!seen) return;
    become(opened.current = seen.draft);
    set_basis({ ...NEW, kept: seen.kept, missing: seen.missing, text: cell_text });
    set_tried(false);
  };
  const missing = still_missing(basis.missing, draft);
  const own_robot = draft.robot.startsWith("/") && robots.every((one) => one.name !== draft.robot);
  return (
    <FaultsContext.Provider value={[...(tried && "wrong" in made ? made.wrong : []), ...(refused ? [refused] : [])]}>
    <form ref={form} onSubmit={(event) => void submit(event)}>
      <h2 id="cell-form-title">{say("cell.title")}</h2>
      <CellSketch draft={draft} from={basis.text === "" ? basis.file : ""} />
      <p class="note">{say("cell.intro", { folder: forms.folder })}</p>
      {cell !== "" && !basis.own && basis.text === "" && <p>{say("cell.other", { file: cell })}</p>}
      <Files name="cell" label={say("cell.open")} accept=".toml" take={([file]) => void open_file(file)} />
      {missing.length > 0 && <p class="refused" role="status">{say("cell.missing", { what: missing.map((one) => one.name).join(", ") })}</p>}
      <div class="pair">
        {text("name")}
        <RobotField draft={draft} choices={own_robot ? [{ name: draft.robot, model: "" }, ...robots] : robots} choose={(robot) => set({ robot })} />
      </div>
      <Files name="machine" label={say("cell.robot.import")} accept=".dat,.toml" multiple take={(files) => void take_robot(files)} />
      {unit?.robot === draft.robot && (
        <LinearUnit key={unit.robot} seen={unit.seen} take={(unit_speed_mm_s) => void import_robot({ ...unit.request, unit_speed_mm_s })} />
      )}
      <fieldset>
        <legend>{say("cell.tool")}</legend>
        <div class="pair">{text("xyz")}{text("abc")}</div>
        <div class="pair">{text("tool_u")}{text("tip")}{text("mass", true)}{text("com", true)}</div>
      </fieldset>
      <fieldset>
        <legend>{say("cell.spheres")}</legend>
        <p class="note">{say("cell.spheres.how")} {say(forms.readsPosition ? "cell.angles.read" : "cell.angles.typed")}</p>
        {draft.spheres.map((sphere, i) => (
          <SphereRow key={i} sphere={sphere} at={`spheres.${i}`} read={forms.readsPosition ? () => read.position(i) : null}
                     {...edits(draft.spheres, (spheres) => set({ spheres }), i)} />
        ))}
        <div class="files">
          <button type="button" class="small" onClick={() => set({ spheres: [...draft.spheres, new_sphere(draft.spheres.length + 1, draft)] })}>
            {say("cell.sphere.add")}
          </button>
          <Files name="spheres" label={say("cell.csv.spheres")} take={([file]) => void read.csv("spheres", file)} />
        </div>
        <Places draft={draft} from={basis.text === "" ? basis.file : ""} asked={(path, body, longest_ms) => read.asked(path, body, longest_ms, told)} show={show} take={(spheres) => set({ spheres })} />
      </fieldset>
      <fieldset>
        <legend>{say("cell.lengths")}</legend>
        <p class="note">{say("cell.lengths.why")}</p>
        {draft.lengths.map((length, i) => (
          <LengthRow key={i} length={length} at={`lengths.${i}`} ids={draft.spheres.map((one) => one.id.trim())}
                     {...edits(draft.lengths, (lengths) => set({ lengths }), i)} />
        ))}
        <div class="files">
          <button type="button" class="small"
                  onClick={() => set({ lengths: [...draft.lengths, new_length(draft.spheres[0]?.id, draft.spheres[1]?.id, draft)] })}>
            {say("cell.length.add")}
          </button>
          <Files name="certificate" label={say("cell.csv.certificate")} take={([file]) => void read.csv("certificate", file)} />
        </div>
        <div class="pair">{text("certificate", true)}{text("date", true)}</div>
        <p class="note">{say("cell.certificate.rows")}</p>
      </fieldset>
      <fieldset>
        <legend>{say("cell.obstacles")}</legend>
        <p class="note">{say("cell.obstacles.why")}</p>
        <div class="pair">{text("floor", true)}</div>
        {draft.obstacles.map((obstacle, i) => (
          <ObstacleRow key={i} obstacle={obstacle} at={`obstacles.${i}`} send={(file) => void read.mesh(i, file)}
                       {...edits(draft.obstacles, (obstacles) => set({ obstacles }), i)} />
        ))}
        <div class="files">
          <button type="button" class="small" onClick={() => set({ obstacles: [...draft.obstacles, new_obstacle(draft.obstacles.length + 1)] })}>
            {say("cell.obstacle.add")}
          </button>
        </div>
      </fieldset>
      {basis.kept.length > 0 && <p class="note">{say("cell.kept", { what: basis.kept.join(", ") })}</p>}
      {basis.own && <p class="note">{say("cell.before", { file: `${basis.file}.before` })}</p>}
      {said !== "" && <p class="refused" role="alert">{said}</p>}
      {leaving ? <Leaving stay={() => ask(false)} close={close} /> : (
        <div class="buttons">
          <button type="button" onClick={() => leave.current?.()}>{say("cancel")}</button>
          <button type="submit" class="go" disabled={busy}>{say("cell.go")}</button>
        </div>
      )}
    </form>
    </FaultsContext.Provider>
  );
}

/** Not the browser's own question: that would block ABORT. */
function Leaving({ stay, close }: { stay: () => void; close: () => void }) {
  const { say } = useVoice();
  const first = useRef<HTMLButtonElement>(null);
  useLayoutEffect(() => {
    const before = document.activeElement;
    first.current?.focus();
    return () => { if (before instanceof HTMLElement) before.focus(); };
  }, []);
  return (
    <div class="buttons">
      <strong role="alert">{say("cell.discard")}</strong>
      <button type="button" onClick={close}>{say("cell.discard.yes")}</button>
      <button ref={first} type="button" class="go" onClick={stay}>{say("cell.discard.no")}</button>
    </div>
  );
}

/** What carries the arm; machine data lack its speed. */
function LinearUnit({ seen, take }: { seen: UnitSeen; take: (speed_mm_s: number) => void }) {
  const { say } = useVoice();
  const [typed, become] = useState("");
  const [x, y, z] = seen.along.map((one) => String(Number(one.toFixed(6))));
  const values = { name: seen.name, min: String(seen.min), max: String(seen.max), x: x ?? "", y: y ?? "", z: z ?? "" };
  if (seen.speed !== null) return <p class="note" role="status">{say("cell.unit.of_file", { ...values, speed: String(seen.speed) })}</p>;
  const speed = Number(typed.trim().replace(",", "."));
  return (
    <div class="files unit">
      <p class="note" role="status">{say("cell.unit", values)}</p>
      <TextField label={say("cell.unit.speed")} name="cell-unit-speed" value={typed} change={become} optional />
      <button type="button" class="small" disabled={!(speed > 0)} onClick={() => take(speed)}>{say("cell.unit.take")}</button>
    </div>
  );
}

function RobotField({ draft, choices, choose }: { draft: CellDraft; choices: { name: string; model: string }[]; choose: (robot: string) => void }) {
  const { say } = useVoice();
  const { marks, words: fault } = useFault("tool.robot");
  return (
    <label>
      {say("cell.robot")}
      <select name="cell-robot" required value={draft.robot} onChange={(event) => choose(event.currentTarget.value)} {...marks}>
        <option value="">{say("cell.robot.choose")}</option>
        {choices.map(({ name, model }) => <option key={name} value={name}>{model === "" ? name : `${model} (${name.replace(/^.*\//, "")})`}</option>)}
      </select>
      {fault}
    </label>
  );
}

/** Proposal of places for the spheres, and the way back to those before. */
function Places({ draft, from, asked, show, take }: {
  draft: CellDraft; from: string; show: (wrong: Wrong[]) => void; take: (spheres: SphereDraft[]) => void;
  asked: (path: string, body: unknown, longest_ms?: number) => Promise<Record<string, unknown> | null>;
}) {
  const { say, fmt } = useVoice();
  const [busy, set_busy] = useState(false);
  const [proposed, become] = useState<{ before: SphereDraft[]; mean: number; u95: number } | null>(null);
  const propose = async () => {
    const wanted = places_wanted(draft);
    if ("wrong" in wanted) return show(wanted.wrong);
    set_busy(true);
    const answer = await asked("/v1/cell-form/places", { form: wanted.form, ...(from === "" ? {} : { from }) }, PLACES_MS);
    set_busy(false);
    if (!answer) return;
    become({ before: draft.spheres, mean: number(answer.predicted_mean_mm) ?? 0, u95: number(answer.predicted_u95_mm) ?? 0 });
    take(placed(draft, sphere_drafts(answer.spheres)));
  };
  const back = () => {
    if (proposed) take(proposed.before);
    become(null);
  };
  return (
    <div class="files places">
      <button type="button" class="small" disabled={busy || draft.spheres.length === 0} onClick={() => void propose()}>
        {say(busy ? "cell.places.busy" : "cell.places")}
      </button>
      {proposed && <button type="button" class="small" onClick={back}>{say("cell.places.undo")}</button>}
      <p class="note" role="status">{proposed ? say("cell.places.found", { mean: fmt.short_mm(proposed.mean), u95: fmt.short_mm(proposed.u95) }) : say("cell.places.why")}</p>
    </div>
  );
}
