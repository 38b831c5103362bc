// Quality of the links to robot and sensor.

import type { ContactLink, RobotLink, Status } from "../types";
import type { Language } from "../words";
import { language_of, useTranslated, useVoice } from "./context";
import { Figure } from "./progress";

const some = (count: number | null) => (count ?? 0) > 0;
/** More than half of the delay that stops the arm. */
const heartbeat_is_late = ({ late_ms }: ContactLink) =>
  late_ms.worst !== null && late_ms.limit !== null && late_ms.worst > late_ms.limit / 2;
/** `words`: of the daemon, on what the link lacks. Null: unknown, too few packets for their cycle. */
export const robot_is_good = (link: RobotLink, words: string): boolean | null =>
  words === "" && !some(link.late) && !some(link.gaps) && !some(link.bad_packets) && (some(link.cycle_ms) || null);
const contact_is_good = (link: ContactLink, words: string) =>
  words === "" && link.loop_ok !== false && link.self_test_ok !== false && !some(link.crc_errors) && !some(link.gaps) &&
  !heartbeat_is_late(link);

/** Words of the daemon on what a link lacks and what to do; empty where it lacks nothing. */
interface Lack {
  words: string;
  lang: Language;
  old: boolean;
}

export function LinksPanel({ status, old }: { status: Status | null; old: boolean }) {
  const { say } = useVoice();
  return (
    <section class="panel" aria-labelledby="links-title" data-old={old}>
      <h2 id="links-title">{say("links")}</h2>
      {status?.links ? <Links status={status} links={status.links} old={old} /> : <p class="note">{say("links.none")}</p>}
    </section>
  );
}

function Links({ status, links, old }: { status: Status; links: NonNullable<Status["links"]>; old: boolean }) {
  const { say } = useVoice();
  const lacking = links.open && (status.robot !== "" || status.contact !== "");
  const [told, lang] = useTranslated(status, lacking);
  const lack = (of: "robot" | "contact"): Lack =>
    ({ words: lacking ? told[of] : "", lang: language_of(told[of], status[of], lang), old });
  return (
    <>
      {!links.open && <p class="note">{say("links.closed")}</p>}
      <Robot link={links.robot} lack={lack("robot")} />
      <Contact link={links.contact} lack={lack("contact")} />
    </>
  );
}

function Heading({ name, good, lack: { words, lang, old } }: { name: string; good: boolean | null; lack: Lack }) {
  const { say } = useVoice();
  return (
    <>
      <h3>
        {name}{" "}
        {!old && good !== null && (
          <span class="badge" data-good={good}>
            <span aria-hidden="true">{good ? "✔" : "▲"}</span> {say(good ? "links.ok" : "links.warn")}
          </span>
        )}
      </h3>
      {!old && words !== "" && <p class="note" lang={lang}>{words}</p>}
    </>
  );
}

/** Before the first packet there are no figures, only initial values. */
function Silent({ name, lack }: { name: string; lack: Lack }) {
  const { say } = useVoice();
  return (
    <>
      <Heading name={name} good={false} lack={lack} />
      {(lack.old || lack.words === "") && <p class="note">{say("links.silent")}</p>}
    </>
  );
}

function Robot({ link, lack }: { link: RobotLink; lack: Lack }) {
  const { say, fmt } = useVoice();
  if (!some(link.packets)) return <Silent name={say("links.robot")} lack={lack} />;
  const late = say("links.late.of", { late: fmt.whole(link.late), replies: fmt.whole(link.replies) });
  return (
    <>
      <Heading name={say("links.robot")} good={robot_is_good(link, lack.words)} lack={lack} />
      <dl class="figures">
        <Figure name={say("links.mode")} value={link.mode === "unknown" ? "–" : link.mode} />
        <Figure name={say("links.override")} value={link.override_percent === null ? "–" : `${fmt.whole(link.override_percent)} %`} />
        {some(link.replies) && <Figure name={say("links.late")} value={late} bad={some(link.late)} />}
        <Figure name={say("links.gaps")} value={fmt.whole(link.gaps)} bad={some(link.gaps)} />
        <Figure name={say("links.bad")} value={fmt.whole(link.bad_packets)} bad={some(link.bad_packets)} />
        {some(link.replies) && <Figure name={say("links.reply")} value={fmt.ms(link.reply_ms.p99)} />}
        <Figure name={say("links.cycle")} value={fmt.ms(some(link.cycle_ms) ? link.cycle_ms : null)} />
        <Figure name={say("links.gap")} value={fmt.ms(link.longest_gap_ms)} />
      </dl>
    </>
  );
}

function Contact({ link, lack }: { link: ContactLink; lack: Lack }) {
  const { say, fmt } = useVoice();
  if (!some(link.frames)) return <Silent name={say("links.contact")} lack={lack} />;
  const heartbeat = say("links.heartbeat.of", {
    worst: fmt.ms(link.late_ms.worst), limit: fmt.ms(link.late_ms.limit),
  });
  const loop = link.loop_ok === null ? "–" : say(link.loop_ok ? "links.loop.ok" : "links.loop.broken");
  const contact = link.in_contact === null ? "–"
    : say(link.in_contact ? "links.contact.closed" : "links.contact.open");
  return (
    <>
      <Heading name={say("links.contact")} good={contact_is_good(link, lack.words)} lack={lack} />
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
