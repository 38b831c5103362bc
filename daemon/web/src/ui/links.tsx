// Quality of the links to robot and sensor.

import type { ContactLink, RobotLink, Status } from "../types";
import { useVoice } from "./context";
import { Figure } from "./progress";

const some = (count: number | null) => (count ?? 0) > 0;
/** More than half of the delay that stops the arm. */
const heartbeat_is_late = (link: ContactLink) =>
  link.lateWorstMs !== null && link.lateLimitMs !== null && link.lateWorstMs > link.lateLimitMs / 2;
const robot_is_good = (link: RobotLink) => !some(link.late) && !some(link.gaps) && !some(link.badPackets);
const contact_is_good = (link: ContactLink) =>
  link.loopOk !== false && link.selfTestOk !== false && !some(link.crcErrors) && !some(link.gaps) &&
  !heartbeat_is_late(link);

export function LinksPanel({ status, old }: { status: Status | null; old: boolean }) {
  const { say } = useVoice();
  const links = status?.links;
  return (
    <section class="panel" aria-labelledby="links-title" data-old={old}>
      <h2 id="links-title">{say("links")}</h2>
      {!links && <p class="note">{say("links.none")}</p>}
      {links && !links.open && <p class="note">{say("links.closed")}</p>}
      {links && <Robot link={links.robot} old={old} />}
      {links && <Contact link={links.contact} old={old} />}
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

function Robot({ link, old }: { link: RobotLink; old: boolean }) {
  const { say, fmt } = useVoice();
  const late = say("links.late.of", { late: fmt.whole(link.late), replies: fmt.whole(link.replies) });
  return (
    <>
      <Heading name={say("links.robot")} good={robot_is_good(link)} old={old} />
      <dl class="figures">
        <Figure name={say("links.mode")} value={link.mode === "unknown" ? "–" : link.mode} />
        <Figure name={say("links.override")} value={link.overridePercent === null ? "–" : `${fmt.whole(link.overridePercent)} %`} />
        <Figure name={say("links.late")} value={late} bad={some(link.late)} />
        <Figure name={say("links.gaps")} value={fmt.whole(link.gaps)} bad={some(link.gaps)} />
        <Figure name={say("links.bad")} value={fmt.whole(link.badPackets)} bad={some(link.badPackets)} />
        <Figure name={say("links.reply")} value={fmt.ms(link.replyP99Ms)} />
        <Figure name={say("links.cycle")} value={fmt.ms(link.cycleMs)} />
        <Figure name={say("links.gap")} value={fmt.ms(link.longestGapMs)} />
      </dl>
    </>
  );
}

function Contact({ link, old }: { link: ContactLink; old: boolean }) {
  const { say, fmt } = useVoice();
  const heartbeat = say("links.heartbeat.of", {
    worst: fmt.ms(link.lateWorstMs), limit: fmt.ms(link.lateLimitMs),
  });
  const loop = link.loopOk === null ? "–" : say(link.loopOk ? "links.loop.ok" : "links.loop.broken");
  const contact = link.inContact === null ? "–"
    : say(link.inContact ? "links.contact.closed" : "links.contact.open");
  return (
    <>
      <Heading name={say("links.contact")} good={contact_is_good(link)} old={old} />
      <dl class="figures">
        <Figure name={say("links.contact.now")} value={contact} />
        <Figure name={say("links.loop")} value={loop} bad={link.loopOk === false} />
        <Figure name={say("links.heartbeat")} value={heartbeat} bad={heartbeat_is_late(link)} />
        <Figure name={say("links.crc")} value={fmt.whole(link.crcErrors)} bad={some(link.crcErrors)} />
        <Figure name={say("links.roundtrip")} value={fmt.ms(link.roundTripP99Ms)} />
        <Figure name={say("links.clock")} value={link.clockSigmaUs === null ? "–" : `± ${fmt.us(link.clockSigmaUs)}`} />
      </dl>
    </>
  );
}
