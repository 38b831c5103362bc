// Picture of the form as far as it has been filled in. The daemon computes the scene; nothing is written.

import { useEffect, useState } from "preact/hooks";
import { sketch_of, type CellDraft } from "../cell_form";
import { fields, list, number, scene } from "../decode";
import { asking, is_good, is_unanswered, NO_TOKEN, post, refusal } from "../request";
import type { Scene } from "../types";
import type { Say } from "../words";
import { useCellView } from "./cell_view";
import { useVoice } from "./context";

const PAUSE_MS = 400, SIGNED_OUT_MS = 2000;

interface Drawn {
  scene: Scene;
  joints: number[];
}
function drawn_of(value: unknown): Drawn | null {
  const all = fields(value);
  const seen = scene(all?.scene);
  return seen && { scene: seen, joints: list(all?.joints_deg).map((one) => number(one) ?? 0) };
}

/** Asked for when the form has not changed for a moment. `refused`: why the form cannot be drawn; the picture is then the one before. */
function useSketch(draft: CellDraft, from: string, say: Say): { drawn: Drawn | null; refused: string } {
  const form = sketch_of(draft);
  const wanted = form === null ? "" : JSON.stringify({ form, ...(from === "" ? {} : { from }) });
  const [seen, become] = useState<{ drawn: Drawn | null; refused: string }>({ drawn: null, refused: "" });
  useEffect(() => {
    if (wanted === "") {
      become({ drawn: null, refused: "" });
      return undefined;
    }
    return asking(() => post("/v1/cell-form/scene", JSON.parse(wanted)), (answer) => {
      const unknown = is_unanswered(answer) || answer.status === NO_TOKEN;
      become((now) => (is_good(answer) ? { drawn: drawn_of(answer.value), refused: "" } : { ...now, refused: unknown ? "" : refusal(answer, say) }));
      return answer.status === NO_TOKEN ? SIGNED_OUT_MS : undefined;
    }, PAUSE_MS);
  }, [wanted]);
  return seen;
}

export function CellSketch({ draft, from }: { draft: CellDraft; from: string }) {
  const { say, theme } = useVoice();
  const { drawn, refused } = useSketch(draft, from, say);
  const { box, view, cannot } = useCellView(drawn !== null);
  useEffect(() => {
    if (!view || !drawn) return;
    view.show_scene(drawn.scene);
    view.show_touches([], [], -1);
    view.move_to(drawn.joints, []);
  }, [view, drawn, theme]);
  const counts = { spheres: drawn?.scene.targets.length ?? 0, obstacles: drawn?.scene.obstacles.length ?? 0 };
  useEffect(() => view?.look_from("fit"), [view, counts.spheres, counts.obstacles]);
  return (
    <div class="sketch">
      <div class="stay">
        <div ref={box} class="canvas" role="img" aria-label={say("cell.sketch.label", counts)} data-spheres={counts.spheres}
             data-obstacles={counts.obstacles} data-empty={drawn === null || cannot} />
        <p class="note">
          {cannot ? say("view.no-webgl") : draft.robot === "" ? say("cell.sketch.none") : drawn && `${say("cell.sketch.label", counts)} ${say("cell.sketch.arm")}`}
        </p>
        {refused !== "" && <p class="refused" role="status">{refused}</p>}
      </div>
    </div>
  );
}
