// Progress of the session: how far, how long, how good, and notes on it.

import { is_at_touch, touch_in_hand } from "../sentence";
import type { PlannedTouch, Status, Touch } from "../types";
import { language_of, useTranslated, useVoice } from "./context";

export function Progress({ status, touches, plan }: { status: Status; touches: Touch[]; plan: PlannedTouch[] }) {
  const { say } = useVoice();
  const [told, lang] = useTranslated(status, status.warnings.length > 0);
  return (
    <div class="progress">
      {status.running && <Ahead status={status} touches={touches} plan={plan} />}
      {told.warnings.map((one, i) => <p class="note" lang={language_of(one, status.warnings[i] ?? "", lang)} key={one}>▲ {one}</p>)}
      {status.interruptions > 0 && <p class="note">{say("interruptions", { n: status.interruptions })}</p>}
      {status.busy_repeats > 0 && <p class="note">{say("busy.repeats", { n: status.busy_repeats })}</p>}
    </div>
  );
}

function Ahead({ status, touches, plan }: { status: Status; touches: Touch[]; plan: PlannedTouch[] }) {
  const { say, fmt } = useVoice();
  const { touches: n, planned: total } = status;
  const share = say(status.kind === "dry-run" ? "progress.standoffs" : "progress.touches", { n, total });
  const next = plan.find((touch) => touch.index === n);
  const ahead = touch_in_hand(status) !== null || next !== undefined;
  const first = touches.find((touch) => touch.u95_mm !== null)?.u95_mm ?? null;
  return (
    <>
      {total > 0 && ( // unknown until the touches are planned
        <div class="bar-line">
          <progress max={total} value={Math.min(n, total)} aria-label={share} />
          <strong>{share}</strong>
        </div>
      )}
      <dl class="figures">
        <Figure name={say("progress.kind")} value={say("progress.kind.of", { session: status.session, kind: say(`kind.${status.kind}`) })} />
        <Figure name={say("progress.time")} value={status.time_left_s === null && (n < total || total === 0) ? say("progress.time.unknown") : fmt.duration(status.time_left_s)} />
        {status.u95_mm !== null && (
          <Figure name={say("u95")} value={(first !== null && first > status.u95_mm ? `${fmt.short_mm(first)} → ` : "") +
            `±${fmt.short_mm(status.u95_mm)}` + (status.goal_mm !== null ? `, ${say("progress.u95.goal", { goal: fmt.short_mm(status.goal_mm) })}` : "")} />
        )}
        {ahead && (
          <Figure name={say("progress.next")} value={next
            ? say("progress.next.touch", { n: n + 1, target: next.target, set: say(`set.${next.set}`) })
            : (is_at_touch(status) && status.target) || "–"} />
        )}
        {status.residual_mm !== null && <Figure name={say("progress.residual")} value={fmt.mm(status.residual_mm)} />}
      </dl>
    </>
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
