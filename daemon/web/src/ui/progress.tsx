// Progress, remaining time, and the next steps.

import { age_ms, type Model } from "../model";
import { touch_in_hand } from "../sentence";
import type { PlannedTouch } from "../types";
import { useVoice } from "./context";

export function ProgressPanel({ model, plan, now }: { model: Model; plan: PlannedTouch[]; now: number }) {
  const { say, fmt } = useVoice();
  const { status } = model;
  if (!status || status.session === 0) return null;
  const { touches: n, planned: total } = status;
  const next = plan.find((touch) => touch.index === n);
  const ahead = status.running && (touch_in_hand(status) !== null || next !== undefined);
  return (
    <section class="panel" aria-labelledby="progress-title" data-old={age_ms(model, now) > 0}>
      <h2 id="progress-title">{say("progress")}</h2>
      <div class="bar-line">
        <progress max={Math.max(1, total)} value={Math.min(n, Math.max(1, total))}
                  aria-label={say("progress.touches", { n, total })} />
        <strong>{say("progress.touches", { n, total })}</strong>
      </div>
      <dl class="figures">
        {status.running && status.timeLeftS !== null && (
          <Figure name={say("progress.time")} value={fmt.duration(status.timeLeftS)} />
        )}
        {ahead && (
          <Figure name={say("progress.next")} value={next
            ? say("progress.next.touch", { n: n + 1, target: next.target, set: say(`set.${next.set}`) })
            : status.target || "–"} />
        )}
        {status.running && status.residualMm !== null && (
          <Figure name={say("progress.residual")} value={fmt.mm(status.residualMm)} />
        )}
        {status.u95Mm !== null && (
          <Figure name={say("progress.u95")} value={fmt.mm(status.u95Mm) +
            (status.goalMm !== null ? `, ${say("progress.u95.goal", { goal: fmt.mm(status.goalMm) })}` : "")} />
        )}
      </dl>
      {status.warnings.map((one) => <p class="note" lang="en" key={one}>▲ {one}</p>)}
      {status.interruptions > 0 && <p class="note">{say("interruptions", { n: status.interruptions })}</p>}
      {status.busyRepeats > 0 && <p class="note">{say("busy.repeats", { n: status.busyRepeats })}</p>}
      {status.busyLeftS !== null && <p class="note">{say("busy.waiting", { left: fmt.duration(status.busyLeftS) })}</p>}
    </section>
  );
}

export function Figure({ name, value, bad = false }: { name: string; value: string; bad?: boolean }) {
  return (
    <div class="figure" data-bad={bad}>
      <dt>{name}</dt>
      <dd>{bad && <span aria-hidden="true">▲ </span>}{value}</dd>
    </div>
  );
}
