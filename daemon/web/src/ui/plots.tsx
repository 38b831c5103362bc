// Plots of a calibration's report, as the daemon draws them.

import { useEffect, useRef } from "preact/hooks";
import { plots as decoded } from "../decode";
import { useFetched, useVoice } from "./context";

/** `svg`: of the daemon, its accessible name is in it. Parsed apart from the page, where nothing is executed. */
function Plot({ svg, caption, wide = false }: { svg: string; caption?: string; wide?: boolean }) {
  const box = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const drawn = new DOMParser().parseFromString(svg, "text/html").querySelector("svg");
    box.current?.replaceChildren(...(drawn ? [document.importNode(drawn, true)] : []));
  }, [svg]);
  return (
    <figure class="plot">
      {caption && <figcaption>{caption}</figcaption>}
      {wide ? <div ref={box} class="scroll" tabIndex={0} /> : <div ref={box} />}
    </figure>
  );
}

export function Plots({ session }: { session: number }) {
  const { say, language } = useVoice();
  const plots = useFetched(`/v1/sessions/${session}/plots?language=${language}`, session, decoded);
  if (!plots) return null;
  return (
    <section class="panel wide plots" aria-labelledby="plots-title">
      <h2 id="plots-title">{say("plots", { session })}</h2>
      {plots.before_after !== "" && <Plot wide svg={plots.before_after} caption={say("plots.before_after")} />}
      {plots.error_map !== "" && (
        <>
          <Plot wide svg={plots.error_map} caption={say("plots.error_map")} />
          <p class="note">{say("plots.error_map.how")}</p>
        </>
      )}
      {plots.by_joint.length > 0 && (
        <>
          <h3>{say("plots.by_joint")}</h3>
          <div class="small-plots">{plots.by_joint.map((svg, i) => <Plot key={i} svg={svg} />)}</div>
          <p class="note">{say("plots.by_joint.how")}</p>
        </>
      )}
    </section>
  );
}
