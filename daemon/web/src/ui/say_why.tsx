// Dialog that asks for a reason. Its request causes no motion.

import type { ComponentChildren } from "preact";
import { useRef, useState } from "preact/hooks";
import { is_good, NOT_REFUSED, post, refused_by } from "../request";
import { useVoice } from "./context";
import { useDialog } from "./dialog";
import { Refused } from "./refused";

const LONGEST_REASON = 500; // bytes, limit of the daemon: two per letter

export function SayWhy({ title, go, needed, path, body, done, close, children }: {
  title: string; go: string; needed: boolean; path: string; body: Record<string, unknown>;
  done: () => void; close: () => void; children?: ComponentChildren;
}) {
  const { say } = useVoice();
  const [reason, set_reason] = useState("");
  const [busy, set_busy] = useState(false);
  const sending = useRef(false); // a sent request is not cancelled by leaving
  const [refused, set_refused] = useState(NOT_REFUSED);
  const dialog = useDialog(() => { if (!sending.current) close(); });
  const why = reason.trim();
  const submit = async (event: Event) => {
    event.preventDefault();
    if (busy || (needed && why === "")) return;
    set_busy(sending.current = true);
    const answer = await post(path, why === "" ? body : { ...body, reason: why });
    set_busy(sending.current = false);
    if (is_good(answer)) done();
    else set_refused(refused_by(answer, say));
  };
  return (
    <>
      <div class="veil" onClick={() => !busy && close()} />
      <dialog ref={dialog} aria-labelledby="why-title">
        <form onSubmit={submit}>
          <h2 id="why-title">{title}</h2>
          {children}
          <label>
            {say(needed ? "why" : "why.if")}
            <input name="reason" type="text" required={needed} maxLength={LONGEST_REASON / 2} value={reason}
                   onInput={(event) => set_reason(event.currentTarget.value)} />
          </label>
          <Refused by={refused} />
          <div class="buttons">
            <button type="button" disabled={busy} onClick={close}>{say("cancel")}</button>
            <button type="submit" class="go" disabled={busy || (needed && why === "")}>{go}</button>
          </div>
        </form>
      </dialog>
    </>
  );
}
