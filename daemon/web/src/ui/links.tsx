// Quality of the links to robot and sensor.

import type { ContactLink, RobotLink, Status } from "../types";
import { useVoice } from "./context";
import { Figure } from "./progress";

const some = (count: number | null) => (count ?? 0) > 0;
/** More than half of the delay that stops the arm. */
const heartbeat_is_late = ({ late_ms }: ContactLink) =>
  late_ms.worst !== null && late_ms.limit !== null && late_ms.worst > late_ms.limit / 2;
/** `words`: of the daemon, on what the link lacks. */
const robot_is_good = (link: RobotLink, words: string) => words === "" && !some(link.late) && !some(link.gaps) && !some(link.bad_packets);
const contact_is_good = (link: ContactLink, words: string) =>
  words === "" && link.loop_ok !== false && link.self_test_ok !== false && !some(link.crc_errors) && !some(link.gaps) &&
  !heartbeat_is_late(link);

export function LinksPanel({ status, old }: { status: Status | null; old: boolean }) {
  const { say } = useVoice();
  const links = status?.links;
  return (
    <section class="panel" aria-labelledby="links-title" data-old={old}>
      <h2 id="links-title">{say("links")}</h2>
      {!links && <p class="note">{say("links.none")}</p>}
      {links && !links.open && <p class="note">{say("links.closed")}</p>}
      {links && <Robot link={links.robot} words={links.open ? status.robot : ""} old={old} />}
      {links && <Contact link={links.contact} words={links.open ? status.contact : ""} old={old} />}
    </section>
  );
}

function Heading({ name, good, old }: { name: string; good: boolean; old: boolean }) {
  const { say } = useVoice();
  return (
    <h3>
      {name}{" "}
      {!old && (
        <span class="badge" data-good={good}>
          <span aria-hidden="true">{good ? "✔" : "▲"}</span> {say(good ? "links.ok" : "links.warn")}
        </span>
      )}
    </h3>
  );
}

/** Before the first packet there are no figures, only initial values. */
function Silent({ name, old }: { name: string; old: boolean }) {
  const { say } = useVoice();
  return (
    <>
      <Heading name={name} good={false} old={old} />
      <p class="note">{say("links.silent")}</p>
    </>
  );
}

function Robot({ link, words, old }: { link: RobotLink; words: string; old: boolean }) {
  const { say, fmt } = useVoice();
  if (!some(link.packets)) return <Silent name={say("links.robot")} old={old} />;
  const late = say("links.late.of", { late: fmt.whole(link.late), replies: fmt.whole(link.replies) });
  return (
    <>
      <Heading name={say("links.robot")} good={robot_is_good(link, words)} old={old} />
      <dl class="figures">
        <Figure name={say("links.mode")} value={link.mode === "unknown" ? "–" : link.mode} />
        <Figure name={say("links.override")} value={link.override_percent === null ? "–" : `${fmt.whole(link.override_percent)} %`} />
        {some(link.replies) && <Figure name={say("links.late")} value={late} bad={some(link.late)} />}
        <Figure name={say("links.gaps")} value={fmt.whole(link.gaps)} bad={some(link.gaps)} />
        <Figure name={say("links.bad")} value={fmt.whole(link.bad_packets)} bad={some(link.bad_packets)} />
        {some(link.replies) && <Figure name={say("links.reply")} value={fmt.ms(link.reply_ms.p99)} />}
        <Figure name={say("links.cycle")} value={fmt.ms(link.cycle_ms)} />
        <Figure name={say("links.gap")} value={fmt.ms(link.longest_gap_ms)} />
      </dl>
    </>
  );
}

function Contact({ link, words, old }: { link: ContactLink; words: string; old: boolean }) {
  const { say, fmt } = useVoice();
  if (!some(link.frames)) return <Silent name={say("links.contact")} old={old} />;
  const heartbeat = say("links.heartbeat.of", {
    worst: fmt.ms(link.late_ms.worst), limit: fmt.ms(link.late_ms.limit),
  });
  const loop = link.loop_ok === null ? "–" : say(link.loop_ok ? "links.loop.ok" : "links.loop.broken");
  const contact = link.in_contact === null ? "–"
    : say(link.in_contact ? "links.contact.closed" : "links.contact.open");
  return (
    <>
      <Heading name={say("links.contact")} good={contact_is_good(link, words)} old={old} />
      <dl class="figures">
        <Figure name={say("links.contact.now")} value={contact} />
        <Figure name={say("links.loop")} value={loop} bad={link.loop_ok === false} />
        <Figure name={say("links.heartbeat")} value={heartbeat} bad={heartbeat_is_late(link)} />
        <Figure name={say("links.crc")} value={fmt.whole(link.crc_errors)} bad={some(link.crc_errors)} />
        <Figure name={say("links.roundtrip")} value={fmt.ms(link.round_trip_ms?.p99 ?? null)} />
        <Figure name={say("links.clock")} value={link.clock_sigma_us === null ? "–" : `± ${fmt.us(link.clock_sigma_us)}`} />
      </dl>
    </>
  );
}
