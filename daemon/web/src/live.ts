// State of the running cell: events, and the status polled in addition. Events keep the page current; polling detects a lost
// connection, after which the displayed data are marked as old.

import * as decode from "./decode";
import { EMPTY, answered, silent, with_posture, with_status, with_touches, without_token, lacks_touches,
         type Model } from "./model";
import { get, NO_TOKEN } from "./request";
import { EventReader, type ServerEvent } from "./sse";

const ASK_EVERY_MS = 1500;
const LONGEST_ANSWER_MS = 3000;
const AGAIN_MS = 1500;
/** Without events the daemon sends a comment every 5 s: a stream that is silent for longer is none, though it may look open. */
const LONGEST_SILENCE_MS = 12_000;

const pause = (ms: number) => new Promise((done) => setTimeout(done, ms));

export class Live {
  model: Model = EMPTY;
  private reading: AbortController | null = null;
  private newest_id = "";
  private filling = false;

  /** `changed` is called after each change. */
  constructor(private readonly changed: () => void) {}

  begin(): void {
    void this.ask_forever();
    void this.listen_forever();
  }

  /** Immediately: after a request that changed something, or a login. */
  async ask(): Promise<void> {
    const asked_at = this.model.status?.seq ?? 0;
    const answer = await get("/v1/status", LONGEST_ANSWER_MS);
    if (answer.status === NO_TOKEN) return this.become(without_token());
    const status = decode.status(answer.value);
    if (answer.status !== 200 || !status) return this.become(silent(this.model, answer.words));
    if (status.seq < asked_at) this.listen_anew();
    this.become(answered(this.model, status, asked_at, performance.now()));
    await this.fill();
  }

  private become(model: Model): void {
    this.model = model;
    this.changed();
  }

  private async ask_forever(): Promise<void> {
    for (;;) {
      await this.ask();
      await pause(ASK_EVERY_MS);
    }
  }

  /** Touches made before this page was opened. */
  private async fill(): Promise<void> {
    const session = this.model.status?.session ?? 0;
    if (this.filling || session === 0 || !lacks_touches(this.model)) return;
    this.filling = true;
    const figures = decode.figures((await get(`/v1/sessions/${session}/figures`)).value);
    if (figures) this.become(with_touches(this.model, figures.touches));
    this.filling = false;
  }

  private listen_anew(): void {
    this.newest_id = "";
    this.reading?.abort();
  }

  private async listen_forever(): Promise<void> {
    for (;;) {
      await this.listen().catch(() => undefined); // interrupted: resumed after the last event
      await pause(AGAIN_MS);
    }
  }

  private async listen(): Promise<void> {
    const reading = this.reading = new AbortController();
    const in_time = async <T>(what: Promise<T>): Promise<T> => {
      const timer = setTimeout(() => reading.abort(), LONGEST_SILENCE_MS);
      return what.finally(() => clearTimeout(timer));
    };
    const headers: Record<string, string> = { Accept: "text/event-stream" };
    if (this.newest_id !== "") headers["Last-Event-ID"] = this.newest_id;
    // Initially from the oldest event available; fill() fetches the rest.
    const answer = await in_time(fetch(this.newest_id === "" ? "/v1/events?since=0" : "/v1/events", {
      headers, signal: reading.signal, cache: "no-store",
    }));
    if (!answer.ok || !answer.body) return;
    const reader = answer.body.getReader();
    const decoder = new TextDecoder();
    const events = new EventReader();
    for (;;) {
      const { done, value } = await in_time(reader.read());
      if (done) return;
      for (const event of events.take(decoder.decode(value, { stream: true }))) this.take(event);
    }
  }

  private take(event: ServerEvent): void {
    if (event.id !== "") this.newest_id = event.id;
    const value = decode.parse(event.data);
    if (event.name === "status") {
      const status = decode.status(value);
      // Past events are repeated where a page is opened late; the newest status is kept.
      if (status && status.seq >= (this.model.status?.seq ?? 0))
        this.become(with_status(this.model, status, performance.now()));
    } else if (event.name === "touch") {
      const touch = decode.touch(value);
      if (touch) this.become(with_touches(this.model, [touch]));
    } else if (event.name === "robot") {
      const posture = decode.posture(value);
      if (posture) this.become(with_posture(this.model, posture, performance.now()));
    }
  }
}
