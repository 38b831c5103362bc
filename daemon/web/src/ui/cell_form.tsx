// Form for the cell's file: robot, tool, spheres and their certificate, typed or from CSV. The daemon reads and writes it; causes
// no motion.

import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";
import {
  cell_forms, EMPTY, form_of, imported, length_drafts, name_within, new_length, new_sphere, robot_choice, sphere_drafts, taught_angles,
  vouch, type CellDraft, type CellForms, type LengthDraft, type Place, type SphereDraft,
} from "../cell_form";
import { fields, words } from "../decode";
import { get, is_good, post, type Answer } from "../request";
import type { Key, Say } from "../words";
import { useVoice } from "./context";
import { examine } from "./doctor";

const PLACES: Place[] = ["centre", "taught", "box"];
const LARGEST_FILE = 1 << 20;

const refusal = (answer: Answer, say: Say): string =>
  answer.status === 0 ? say("request.no-answer") : answer.words || say("request.refused", { status: answer.status });

/** Forms created here, and the form of `cell` if it was created here. */
function useForms(cell: string): { forms: CellForms | null; refused: Answer | null } {
  const [seen, become] = useState<{ forms: CellForms | null; refused: Answer | null }>({ forms: null, refused: null });
  useEffect(() => {
    let over = false;
    const ask = async () => {
      let answer = await get("/v1/cell-form");
      const name = name_within(cell_forms(answer.value)?.folder ?? "", cell);
      if (cell !== "") {
        const asked = name !== "" ? `name=${encodeURIComponent(name)}` : `file=${encodeURIComponent(cell)}`;
        const one = await get(`/v1/cell-form?${asked}`);
        if (is_good(one)) answer = one;
      }
      if (!over) become({ forms: is_good(answer) ? cell_forms(answer.value) : null, refused: is_good(answer) ? null : answer });
    };
    void ask();
    return () => { over = true; };
  }, [cell]);
  return seen;
}

export function CellDialog({ cell, done, close }: { cell: string; done: () => void; close: () => void }) {
  const { say } = useVoice();
  const { forms, refused } = useForms(cell);
  const dialog = useRef<HTMLDialogElement>(null);
  // Not modal: the abort button must stay accessible.
  useLayoutEffect(() => {
    dialog.current?.show();
    const leave = (event: KeyboardEvent) => event.key === "Escape" && close();
    addEventListener("keydown", leave);
    return () => removeEventListener("keydown", leave);
  }, []);
  return (
    <>
      <div class="veil" />
      <dialog ref={dialog} class="wide" aria-labelledby="cell-form-title">
        {forms && (forms.shown === null || forms.shown.draft !== null)
          ? <CellFields cell={cell} forms={forms} done={done} close={close} />
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

function CellFields({ cell, forms, done, close }: { cell: string; forms: CellForms; done: () => void; close: () => void }) {
  const { say } = useVoice();
  const [draft, become] = useState<CellDraft>(forms.shown?.draft ?? EMPTY);
  const [robots, set_robots] = useState(forms.robots);
  // Created here: replaced. Any other file is left unchanged, and a new one is written.
  const own = forms.shown !== null && name_within(forms.folder, forms.shown.file) !== "";
  const [busy, set_busy] = useState(false);
  const [said, set_said] = useState("");
  const before = useRef(draft);
  const set = (change: Partial<CellDraft>) => become((now) => ({ ...now, ...change }));
  const text = (key: "name" | "xyz" | "abc" | "tool_u" | "mass" | "tip" | "certificate" | "date", optional = false) => (
    <label>
      {say(`cell.${key}`)}
      <input name={`cell-${key}`} type="text" required={!optional} value={draft[key]} disabled={key === "name" && own}
             placeholder={key === "date" ? "2026-04-01" : undefined}
             onFocus={() => { before.current = draft; }}
             onInput={(event) => {
               const value = event.currentTarget.value;
               become((now) => (key === "certificate" || key === "date" ? vouch(now, { [key]: value }, before.current) : { ...now, [key]: value }));
             }} />
    </label>
  );
  const submit = async (event: Event) => {
    event.preventDefault();
    if (busy) return;
    const made = form_of(draft);
    if ("wrong" in made) {
      const { field, of, counts } = made.wrong;
      set_said(field === "robot" ? say("cell.wrong.robot")
        : say("cell.wrong", { of: of === "" ? say("cell.tool") : of, field: say(`cell.${field}` as Key), n: counts.join(say("cell.or")) }));
      return;
    }
    set_busy(true);
    const answer = await post("/v1/cell-form", {
      name: draft.name.trim(), form: made.form, ...(!forms.shown ? {} : own ? { instead_of: forms.shown.sha256 } : { from: forms.shown.file }),
    });
    // The doctor examines it, and the guide refers to the cell examined last.
    const words_ = is_good(answer) ? await examine(words(fields(answer.value)?.file), say) : refusal(answer, say);
    set_busy(false);
    set_said(words_);
    if (words_ === "") done();
  };
  const text_in = async (file: File): Promise<string> => {
    const read = file.size > LARGEST_FILE ? "" : await file.text().catch(() => "");
    if (read === "") set_said(say("cell.csv.none", { file: file.name }));
    return read;
  };
  const read_machine = async (files: File[]) => {
    const request: { machine_data?: string; robcor?: string } = {};
    for (const file of files) {
      const data = await text_in(file);
      if (data === "") return;
      request[/robcor/i.test(file.name) ? "robcor" : "machine_data"] = data;
    }
    const answer = await post("/v1/cell-form/robot", request);
    const robot = is_good(answer) ? robot_choice(answer.value) : null;
    set_said(robot !== null ? "" : refusal(answer, say));
    if (robot === null) return;
    set_robots((now) => [...now.filter((one) => one.name !== robot.name), robot]);
    set({ robot: robot.name });
  };
  const read_csv = async (kind: "spheres" | "certificate", file: File | undefined) => {
    if (!file) return;
    const csv = await text_in(file);
    if (csv === "") return;
    const answer = await post("/v1/cell-form/lists", { [kind]: csv });
    set_said(is_good(answer) ? "" : refusal(answer, say));
    const read = fields(answer.value);
    if (!is_good(answer) || !read) return;
    become((now) => imported(now, kind === "spheres" ? { spheres: sphere_drafts(read.spheres) } : { lengths: length_drafts(read.lengths) }));
  };
  const read_position = async (row: number) => {
    const answer = await post("/v1/position", {});
    const where = is_good(answer) ? taught_angles(answer.value) : null;
    set_said(where !== null ? "" : refusal(answer, say));
    if (where === null) return;
    become((now) => ({ ...now, spheres: now.spheres.map((one, k) => (k === row ? { ...one, where } : one)) }));
  };
  return (
    <form onSubmit={(event) => void submit(event)}>
      <h2 id="cell-form-title">{say("cell.title")}</h2>
      <p class="note">{say("cell.intro", { folder: forms.folder })}</p>
      {cell !== "" && !own && <p>{say("cell.other", { file: cell })}</p>}
      <div class="pair">
        {text("name")}
        <label>
          {say("cell.robot")}
          <select name="cell-robot" required value={draft.robot} onChange={(event) => set({ robot: event.currentTarget.value })}>
            <option value="">{say("cell.robot.choose")}</option>
            {draft.robot.startsWith("/") && robots.every((one) => one.name !== draft.robot) && <option value={draft.robot}>{draft.robot}</option>}
            {robots.map((one) => <option key={one.name} value={one.name}>{one.model} ({one.name.replace(/^.*\//, "")})</option>)}
          </select>
        </label>
      </div>
      <Files name="machine" label={say("cell.robot.import")} accept=".dat" multiple take={(files) => void read_machine(files)} />
      <fieldset>
        <legend>{say("cell.tool")}</legend>
        <div class="pair">{text("xyz")}{text("abc")}</div>
        <div class="pair">{text("tool_u")}{text("mass", true)}{text("tip")}</div>
      </fieldset>
      <fieldset>
        <legend>{say("cell.spheres")}</legend>
        <p class="note">{say("cell.spheres.how")} {say(forms.readsPosition ? "cell.angles.read" : "cell.angles.typed")}</p>
        {draft.spheres.map((sphere, i) => (
          <SphereRow key={i} sphere={sphere} read={forms.readsPosition ? () => read_position(i) : null}
                     change={(change) => set({ spheres: draft.spheres.map((one, k) => (k === i ? { ...one, ...change } : one)) })}
                     drop={() => set({ spheres: draft.spheres.filter((_, k) => k !== i) })} />
        ))}
        <div class="files">
          <button type="button" class="small" onClick={() => set({ spheres: [...draft.spheres, new_sphere(draft.spheres.length + 1, draft)] })}>
            {say("cell.sphere.add")}
          </button>
          <Files name="spheres" label={say("cell.csv.spheres")} take={([file]) => void read_csv("spheres", file)} />
        </div>
      </fieldset>
      <fieldset>
        <legend>{say("cell.lengths")}</legend>
        <p class="note">{say("cell.lengths.why")}</p>
        {draft.lengths.map((length, i) => (
          <LengthRow key={i} length={length} ids={draft.spheres.map((one) => one.id.trim())}
                     change={(change) => set({ lengths: draft.lengths.map((one, k) => (k === i ? { ...one, ...change } : one)) })}
                     drop={() => set({ lengths: draft.lengths.filter((_, k) => k !== i) })} />
        ))}
        <div class="files">
          <button type="button" class="small"
                  onClick={() => set({ lengths: [...draft.lengths, new_length(draft.spheres[0]?.id, draft.spheres[1]?.id, draft)] })}>
            {say("cell.length.add")}
          </button>
          <Files name="certificate" label={say("cell.csv.certificate")} take={([file]) => void read_csv("certificate", file)} />
        </div>
        <div class="pair">{text("certificate", true)}{text("date", true)}</div>
        <p class="note">{say("cell.certificate.rows")}</p>
      </fieldset>
      <p class="note">{say("cell.obstacles")}</p>
      {forms.shown && forms.shown.kept.length > 0 && <p class="note">{say("cell.kept", { what: forms.shown.kept.join(", ") })}</p>}
      {own && forms.shown && <p class="note">{say("cell.before", { file: `${forms.shown.file}.before` })}</p>}
      {said !== "" && <p class="refused" role="alert">{said}</p>}
      <div class="buttons">
        <button type="button" onClick={close}>{say("cancel")}</button>
        <button type="submit" class="go" disabled={busy}>{say("cell.go")}</button>
      </div>
    </form>
  );
}

function Files({ name, label, take, accept = ".csv,.xml,text/csv,text/xml", multiple = false }: {
  name: string; label: string; take: (files: File[]) => void; accept?: string; multiple?: boolean;
}) {
  return (
    <label class="csv">
      {label}
      <input name={`csv-${name}`} type="file" accept={accept} multiple={multiple}
             onChange={(event) => {
               take([...event.currentTarget.files ?? []]);
               event.currentTarget.value = ""; // permits reading the same file again
             }} />
    </label>
  );
}

function SphereRow({ sphere, read, change, drop }: {
  sphere: SphereDraft; read: (() => Promise<void>) | null; change: (change: Partial<SphereDraft>) => void; drop: () => void;
}) {
  const { say } = useVoice();
  const [reading, set_reading] = useState(false);
  const text = (key: "id" | "diameter" | "u" | "where" | "rough" | "serial" | "certificate" | "date", label: string, optional = false) => (
    <label class={key}>
      {label}
      <input name={`sphere-${key}`} type="text" required={!optional} value={sphere[key]}
             onInput={(event) => change({ [key]: event.currentTarget.value })} />
    </label>
  );
  return (
    <fieldset class="row" data-sphere={sphere.id}>
      <legend>{sphere.id}</legend>
      {text("id", say("cell.id"))}
      {text("diameter", say("cell.diameter"))}
      {text("u", say("cell.u"))}
      {text("serial", say("cell.serial"), true)}
      {text("certificate", say("cell.row.certificate"), true)}
      {text("date", say("cell.row.date"), true)}
      <label class="place">
        {say("cell.place")}
        <select name="sphere-place" value={sphere.place} onChange={(event) => change({ place: event.currentTarget.value as Place, where: "" })}>
          {PLACES.map((one) => <option key={one} value={one}>{say(`cell.place.${one}`)}</option>)}
        </select>
      </label>
      {text("where", say(`cell.where.${sphere.place}`))}
      {sphere.place === "taught" && read && (
        <button type="button" class="small read" disabled={reading}
                onClick={() => { set_reading(true); void read().finally(() => set_reading(false)); }}>
          {say("cell.position")}
        </button>
      )}
      {sphere.place !== "box" && text("rough", say("cell.rough"))}
      <button type="button" class="small drop" aria-label={say("cell.drop", { of: sphere.id })} onClick={drop}>✕</button>
    </fieldset>
  );
}

function LengthRow({ length, ids, change, drop }: {
  length: LengthDraft; ids: string[]; change: (change: Partial<LengthDraft>) => void; drop: () => void;
}) {
  const { say } = useVoice();
  const of = `${length.from}–${length.to}`;
  const end = (key: "from" | "to") => (
    <label class="id">
      {say(`cell.${key}`)}
      <select name={`length-${key}`} required value={length[key]} onChange={(event) => change({ [key]: event.currentTarget.value })}>
        <option value="" />
        {ids.map((id) => <option key={id} value={id}>{id}</option>)}
      </select>
    </label>
  );
  const text = (key: "mm" | "u" | "certificate" | "date", label: string, optional = false) => (
    <label class={key === "mm" ? "diameter" : key}>
      {label}
      <input name={`length-${key}`} type="text" required={!optional} value={length[key]}
             onInput={(event) => change({ [key]: event.currentTarget.value })} />
    </label>
  );
  return (
    <fieldset class="row" data-length={of}>
      <legend>{of}</legend>
      {end("from")}{end("to")}{text("mm", say("cell.mm"))}{text("u", say("cell.u"))}
      {text("certificate", say("cell.row.certificate"), true)}{text("date", say("cell.row.date"), true)}
      <button type="button" class="small drop" aria-label={say("cell.drop", { of })} onClick={drop}>✕</button>
    </fieldset>
  );
}
