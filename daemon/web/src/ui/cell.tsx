// 3D view of the cell. Its library is loaded separately: nothing else waits for it.

import { useEffect } from "preact/hooks";
import type { Side } from "../cell/view";
import { age_ms, measured_posture, type Model } from "../model";
import { NONE, type Formats } from "../format";
import type { PlannedTouch, RobotPosture, Scene } from "../types";
import { useCellView } from "./cell_view";
import { useVoice } from "./context";
import type { Key } from "../words";

const SIDES: Side[] = ["fit", "front", "side", "top"];

/** Drawn posture of arm and positioner, and its source. */
export function drawn_posture(model: Model, plan: PlannedTouch[], now: number): { at: Omit<RobotPosture, "session">; key: Key } | null {
  const measured = measured_posture(model, now);
  if (measured) return { at: measured, key: "view.pose.live" };
  const newest = model.touches.at(-1);
  if (newest && newest.joints_deg.length > 0) return { at: newest, key: "view.pose.touch" };
  const first = plan[0];
  return first ? { at: first, key: "view.pose.start" } : null;
}

/** "E1 31.5°, E2 −90.0°" */
const axes_words = (scene: Scene, positioner: number[], fmt: Formats): string =>
  scene.positioner.map((axis, i) => `${axis.name} ${positioner[i] === undefined ? NONE : fmt.degrees(positioner[i], 1)}`).join(", ");

/** `nothing`: no session, hence no cell. */
export function CellPanel({ model, scene, plan, now, nothing }: {
  model: Model; scene: Scene | null; plan: PlannedTouch[]; now: number; nothing: boolean;
}) {
  const { say, theme, fmt } = useVoice();
  const { box, view, cannot } = useCellView(model.status !== null);
  const old = age_ms(model, now) > 0;
  const drawn = drawn_posture(model, plan, now);

  useEffect(() => { if (view && scene) view.show_scene(scene); }, [view, scene, theme]);
  useEffect(() => {
    view?.show_touches(plan, model.touches, model.status?.running ? model.status.touches : -1);
  }, [view, scene, plan, model.touches, model.status?.touches, model.status?.running, theme]);
  useEffect(() => { view?.move_to(drawn?.at.joints_deg ?? [], drawn?.at.positioner_deg ?? []); }, [view, scene, drawn?.at]);

  const newest = model.touches.at(-1);
  const label = say("view.label", {
    spheres: scene?.targets.length ?? 0, made: model.touches.length,
    planned: model.status?.planned ?? 0, target: newest?.target ?? "–",
  });
  return (
    <section class="panel cell" aria-labelledby="cell-title" data-old={old}>
      <div class="cell-head">
        <h2 id="cell-title">{say("view")}</h2>
        {scene && drawn && !cannot && <span class="note">{say(drawn.key)}{old ? ` (${say("view.old")})` : ""}</span>}
        {scene && drawn && scene.positioner.length > 0 && (
          <span class="note" data-positioner>{axes_words(scene, drawn.at.positioner_deg, fmt)}</span>
        )}
        {scene && !cannot && (
          <span class="sides">
            {SIDES.map((side) => (
              <button key={side} type="button" class="small" onClick={() => view?.look_from(side)}>{say(`view.${side}`)}</button>
            ))}
          </span>
        )}
      </div>
      {cannot && <p class="note">{say("view.no-webgl")}</p>}
      {nothing && !cannot && <p class="note">{say("view.none")}</p>}
      <div ref={box} class="canvas" role="img" aria-label={label} data-empty={nothing || cannot} />
      {scene && !cannot && (
        <ul class="legend" aria-hidden="true">
          {(["planned", "fit", "check", "next"] as const).map((one) => (
            <li key={one} data-mark={one}>{say(`view.legend.${one}`)}</li>
          ))}
        </ul>
      )}
    </section>
  );
}
