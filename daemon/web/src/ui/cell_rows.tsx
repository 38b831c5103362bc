// Fields and rows of the cell form.

import { createContext } from "preact";
import { useContext, useState } from "preact/hooks";
import { SHAPES, type LengthDraft, type ObstacleDraft, type Place, type Refused, type SphereDraft, type Wrong } from "../cell_form";
import type { Say } from "../words";
import { useVoice } from "./context";

const PLACES: Place[] = ["centre", "taught", "box"];

/** Errors of the form, found here or by the daemon, shown at their fields. */
export const FaultsContext = createContext<(Wrong | Refused)[]>([]);

export const fault_words = ({ counts, positive }: Wrong, say: Say): string =>
  counts.length === 0 ? say("cell.wrong.choose")
    : say(positive ? "cell.wrong.positive" : "cell.wrong.numbers", { n: counts.join(say("cell.or")) });

/** The error of a field, and the attributes that refer to it. */
export function useFault(at: string) {
  const { say } = useVoice();
  const wrong = useContext(FaultsContext).find((one) => one.at === at);
  const id = `wrong-${at}`;
  return {
    marks: wrong ? { "aria-invalid": true as const, "aria-describedby": id } : {},
    words: !wrong ? null : "reason" in wrong ? <span id={id} class="fault" lang="en">{wrong.reason}</span>
      : <span id={id} class="fault">{fault_words(wrong, say)}</span>,
  };
}

export function TextField({ label, name, at = "", value, change, optional = false, ...more }: {
  label: string; name: string; at?: string; value: string; change: (value: string) => void; optional?: boolean;
  class?: string; disabled?: boolean; placeholder?: string | undefined; focused?: () => void;
}) {
  const { marks, words } = useFault(at);
  return (
    <label class={more.class}>
      {label}
      <input name={name} type="text" required={!optional} value={value} disabled={more.disabled} placeholder={more.placeholder}
             onFocus={more.focused} onInput={(event) => change(event.currentTarget.value)} {...marks} />
      {words}
    </label>
  );
}

export function Files({ name, label, take, accept = ".csv,.xml,text/csv,text/xml", multiple = false, at = "" }: {
  name: string; label: string; take: (files: File[]) => void; accept?: string; multiple?: boolean; at?: string;
}) {
  const { marks, words } = useFault(at);
  return (
    <label class="csv">
      {label}
      <input name={`csv-${name}`} type="file" accept={accept} multiple={multiple} {...marks}
             onChange={(event) => {
               take([...event.currentTarget.files ?? []]);
               event.currentTarget.value = ""; // permits reading the same file again
             }} />
      {words}
    </label>
  );
}

const Drop = ({ of, drop }: { of: string; drop: () => void }) => (
  <button type="button" class="small drop" aria-label={useVoice().say("cell.drop", { of })} onClick={drop}>✕</button>
);

export function SphereRow({ sphere, at, read, change, drop }: {
  sphere: SphereDraft; at: string; read: (() => Promise<void>) | null; change: (change: Partial<SphereDraft>) => void; drop: () => void;
}) {
  const { say } = useVoice();
  const [reading, set_reading] = useState(false);
  const text = (key: "id" | "diameter" | "u" | "where" | "rough" | "serial" | "certificate" | "date", label: string, optional = false) => (
    <TextField class={key} label={label} name={`sphere-${key}`} at={`${at}.${key}`} value={sphere[key]} optional={optional}
               change={(value) => change({ [key]: value })} />
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
      <Drop of={sphere.id} drop={drop} />
    </fieldset>
  );
}

export function LengthRow({ length, at, ids, change, drop }: {
  length: LengthDraft; at: string; ids: string[]; change: (change: Partial<LengthDraft>) => void; drop: () => void;
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
    <TextField class={key === "mm" ? "diameter" : key} label={label} name={`length-${key}`} at={`${at}.${key}`} value={length[key]} optional={optional}
               change={(value) => change({ [key]: value })} />
  );
  return (
    <fieldset class="row" data-length={of}>
      <legend>{of}</legend>
      {end("from")}{end("to")}{text("mm", say("cell.mm"))}{text("u", say("cell.u"))}
      {text("certificate", say("cell.row.certificate"), true)}{text("date", say("cell.row.date"), true)}
      <Drop of={of} drop={drop} />
    </fieldset>
  );
}

/** `send`: an STL file to the daemon. */
export function ObstacleRow({ obstacle, at, send, change, drop }: {
  obstacle: ObstacleDraft; at: string; send: (file: File) => void; change: (change: Partial<ObstacleDraft>) => void; drop: () => void;
}) {
  const { say } = useVoice();
  const { shape, file } = obstacle;
  const text = (key: "id" | "size" | "middle" | "turn", label: string) => (
    <TextField class={key === "id" ? "id" : "where"} label={label} name={`obstacle-${key}`} at={`${at}.${key}`} value={obstacle[key]}
               change={(value) => change({ [key]: value })} />
  );
  return (
    <fieldset class="row" data-obstacle={obstacle.id}>
      <legend>{obstacle.id}</legend>
      {text("id", say("cell.id"))}
      <label class="place">
        {say("cell.shape")}
        <select name="obstacle-shape" value={shape} onChange={(event) => change({ shape: event.currentTarget.value as ObstacleDraft["shape"], size: "", file: "" })}>
          {SHAPES.map((one) => <option key={one} value={one}>{say(`cell.shape.${one}`)}</option>)}
        </select>
      </label>
      {shape === "mesh"
        ? <Files name="mesh" label={file === "" ? say("cell.file") : say("cell.file.have", { file: file.replace(/^.*\//, "") })} accept=".stl" at={`${at}.file`}
                 take={([one]) => one && send(one)} />
        : text("size", say(`cell.size.${shape}`))}
      {text("middle", say(shape === "mesh" ? "cell.origin" : "cell.middle"))}
      {text("turn", say("cell.turn"))}
      <Drop of={obstacle.id} drop={drop} />
    </fieldset>
  );
}
