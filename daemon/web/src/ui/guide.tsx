// Steps from nothing to a calibrated cell: completed ones, the next one and its instructions. The daemon determines which steps
// are done.

import { useEffect, useState } from "preact/hooks";
import { shell_word } from "../format";
import { NOT_REFUSED } from "../request";
import type { Readiness, StepName, StepSeen } from "../types";
import { useVoice } from "./context";
import { examine } from "./doctor";
import { Refused } from "./refused";
import { StartDialog, WHOLE, type Wish } from "./start";

const MARKS: Record<StepSeen["state"], string> = { done: "✔", wrong: "✖", todo: "○" };
/** A few touches that test whether the cell works. */
const FIRST: Partial<Wish> = { kind: "calibrate", touches: "8", check: "0" };
/** The path of WHOLE, without touching. */
const DRY: Partial<Wish> = { ...WHOLE, kind: "dry-run" };
const AS_A_WHOLE = `--touches ${WHOLE.touches} --check ${WHOLE.check}`;
/** Steps that are a session. */
const WISHES = { qualify: { kind: "qualify" } as Partial<Wish>, "dry-run": DRY, first: FIRST, calibration: WHOLE };
const is_session = (step: StepName): step is keyof typeof WISHES => step in WISHES;

export function command_of(step: StepName, cell: string): string {
  const file = cell === "" ? "/etc/cellcal/cell.toml" : shell_word(cell);
  switch (step) {
    case "cell": return cell === "" ? `sudo cellcal new-cell -o ${file}` : `cellcal plan --cell ${file} ${AS_A_WHOLE}`;
    case "robot": case "spheres": return `cellcal plan --cell ${file} ${AS_A_WHOLE}`;
    case "doctor": return `cellcal doctor --cell ${file}`;
    case "qualify": return `cellcal qualify --cell ${file}`;
    case "dry-run": return `cellcal dry-run --cell ${file} ${AS_A_WHOLE}`;
    case "first": return `cellcal run --cell ${file} --touches ${FIRST.touches} --check ${FIRST.check}`;
    case "calibration": return `cellcal run --cell ${file} ${AS_A_WHOLE}`;
  }
}

/** Steps that are corrected in the form. */
const IN_THE_FORM: StepName[] = ["cell", "robot", "spheres"];

/** `quiet`: another panel has priority, and the next step is not the page's first button. `enter`: opens the cell's form. */
export function GuidePanel({ readiness, may, looking, quiet, enter, begun, started, again }: {
  readiness: Readiness; may: boolean; looking: boolean; quiet: boolean;
  enter: () => void; begun: () => void; started: () => void; again: () => void;
}) {
  const { say } = useVoice();
  const { steps, cell } = readiness;
  const done = steps.filter((one) => one.state === "done").length;
  if (readiness.next === null) return null;
  const calibrated = steps.some((one) => one.step === "calibration" && one.state === "done");
  return (
    <section class="panel guide" aria-labelledby="guide-title">
      <details open={!calibrated && !quiet}>
        <summary><h2 id="guide-title">{say("guide", { n: done, total: steps.length })}</h2>{" "}
          <span class="note">{say("guide.next", { step: say(`step.${readiness.next}`) })}</span></summary>
        {cell !== "" && <p class="note">{[cell, readiness.robot].filter((one) => one !== "").join(" · ")}</p>}
        {may && (
          <div class="files">
            <button type="button" class={IN_THE_FORM.includes(readiness.next) ? "go" : "small"} onClick={enter}>
              {say(cell === "" ? "cell.make" : "cell.edit")}
            </button>
          </div>
        )}
        <ol>
          {steps.map((seen) => (
            <li key={seen.step} data-step={seen.step} data-state={seen.state}
                aria-current={seen.step === readiness.next ? "step" : undefined}>
              <p>
                <span class="mark" aria-hidden="true">{seen.step === readiness.next && seen.state === "todo" ? "▶" : MARKS[seen.state]}</span>{" "}
                <strong>{say(`step.${seen.step}`)}</strong>{" "}
                <span class="note">{say(`step.state.${seen.state}`)}{seen.session !== null && ` (${say("guide.session", { session: seen.session })})`}</span>
              </p>
              {seen.state === "wrong" && <Wrong seen={seen} readiness={readiness} />}
              {seen.step === readiness.next && (
                <Next step={seen.step} cell={cell} may={may} looking={looking} begun={begun} started={started} />
              )}
            </li>
          ))}
        </ol>
        <button type="button" class="small" onClick={again}>{say("guide.again")}</button>
      </details>
    </section>
  );
}

function Wrong({ seen, readiness }: { seen: StepSeen; readiness: Readiness }) {
  const { say } = useVoice();
  const { spheres, placed } = readiness;
  return (
    <>
      {seen.words !== "" && <p class="refused">{seen.words}</p>}
      {seen.step === "spheres" && seen.words === "" && <p>{say("guide.placed", { placed, spheres })}</p>}
    </>
  );
}

function Next({ step, cell, may, looking, begun, started }: {
  step: StepName; cell: string; may: boolean; looking: boolean; begun: () => void; started: () => void;
}) {
  const { say } = useVoice();
  const [open, set_open] = useState(false);
  return (
    <div class="next">
      <p>{say(`step.do.${step}`)}</p>
      <p class="note"><code>{command_of(step, cell)}</code></p>
      {may && !is_session(step) && <Look cell={cell} first={!IN_THE_FORM.includes(step)} looking={looking} begun={begun} />}
      {may && is_session(step) && (
        <button type="button" class="go" onClick={() => set_open(true)}>{say(`step.go.${step}`)}</button>
      )}
      {open && is_session(step) && (
        <StartDialog last_cell={cell} preset={WISHES[step]} close={() => set_open(false)}
                     done={() => { set_open(false); started(); }} />
      )}
    </div>
  );
}

/** Selection of the cell, and its examination by the doctor. */
function Look({ cell, first, looking, begun }: { cell: string; first: boolean; looking: boolean; begun: () => void }) {
  const { say } = useVoice();
  const [path, become] = useState(cell);
  const [refused, set_refused] = useState(NOT_REFUSED);
  useEffect(() => become(cell), [cell]);
  const look = async (event: Event) => {
    event.preventDefault();
    set_refused(await examine(path.trim(), say));
    begun();
  };
  return (
    <form class="look" onSubmit={(event) => void look(event)}>
      <label>
        {say("start.cell")}
        <input name="guide-cell" type="text" required value={path} placeholder={say("start.cell.hint")}
               onInput={(event) => become(event.currentTarget.value)} />
      </label>
      <button type="submit" class={first ? "go" : ""} disabled={looking}>{say(looking ? "doctor.running" : "doctor.look")}</button>
      <Refused by={refused} />
    </form>
  );
}
