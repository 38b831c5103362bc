// Parser of server-sent events (WHATWG HTML, 9.2.6) from a text stream split at arbitrary positions.

export interface ServerEvent {
  name: string;
  data: string;
  /** Of this event or the newest before it. */
  id: string;
}

/** Longer lines and events are dropped: none of this page's events is as long. */
const MOST_LETTERS = 1_000_000;

export class EventReader {
  private rest = "";
  private name = "";
  private data: string[] = [];
  private size = 0;
  private overlong = false;
  private id = "";

  /** Events completed by this text. */
  take(text: string): ServerEvent[] {
    const events: ServerEvent[] = [];
    const lines = (this.rest + text).split(/\r\n|\n|\r(?!$)/);
    this.rest = lines.pop() ?? "";
    if (this.rest.length > MOST_LETTERS) {
      this.rest = "";
      this.overlong = true;
    }
    for (const line of lines) {
      if (line === "") this.finish(events);
      else this.field(line);
    }
    return events;
  }

  private finish(events: ServerEvent[]): void {
    if (this.data.length > 0 && !this.overlong)
      events.push({ name: this.name || "message", data: this.data.join("\n"), id: this.id });
    this.name = "";
    this.data = [];
    this.size = 0;
    this.overlong = false;
  }

  private field(line: string): void {
    const colon = line.indexOf(":");
    if (colon === 0) return; // comment: keep-alive
    const key = colon < 0 ? line : line.slice(0, colon);
    const value = colon < 0 ? "" : line.slice(colon + 1).replace(/^ /, "");
    if (key === "event") this.name = value;
    if (key === "id" && !value.includes("\0")) this.id = value;
    if (key !== "data") return;
    this.size += value.length;
    if (this.size > MOST_LETTERS) this.overlong = true;
    else this.data.push(value);
  }
}
