// The 3D view in an element of the page.

import { useEffect, useRef, useState } from "preact/hooks";
import type { RefObject } from "preact";
import type { CellView } from "../cell/view";

/** Resolves when the rendering is on the screen; in a hidden tab, too. */
const painted = () => new Promise<void>((resolve) => {
  const timer = setTimeout(resolve, 500);
  requestAnimationFrame(() => setTimeout(() => { clearTimeout(timer); resolve(); }));
});

/** `begin`: the page shows its first sentence; parsing the library occupies a slow computer for 0.1 s. `cannot`: no WebGL, or the
 *  library was not loaded. */
export function useCellView(begin: boolean): { box: RefObject<HTMLDivElement>; view: CellView | null; cannot: boolean } {
  const box = useRef<HTMLDivElement>(null);
  const [view, set_view] = useState<CellView | null>(null);
  const [cannot, set_cannot] = useState(false);
  useEffect(() => {
    if (!begin) return undefined;
    let wanted = true, made: CellView | null = null;
    void painted().then(() => import("../cell/view"))
      .then(({ CellView: View }) => {
        if (!wanted || !box.current) return;
        made = new View(box.current);
        set_view(made);
      })
      .catch(() => set_cannot(true));
    return () => {
      wanted = false;
      made?.close();
      set_view(null);
    };
  }, [begin]);
  return { box, view, cannot };
}
