// Login: without a token the daemon reports nothing about the cell.

import { useState } from "preact/hooks";
import { is_good, NO_TOKEN, post, refusal, type Answer } from "../request";
import type { Say } from "../words";
import { useVoice } from "./context";

/** A daemon that is busy, or does not know the host, says nothing of the token. */
export const login_refusal = (answer: Answer, say: Say): string => (answer.status === NO_TOKEN ? say("login.wrong") : refusal(answer, say));

export function Login({ done }: { done: () => void }) {
  const { say } = useVoice();
  const [token, set_token] = useState("");
  const [wrong, set_wrong] = useState("");
  const submit = async (event: Event) => {
    event.preventDefault();
    const answer = await post("/v1/login", { token: token.trim() });
    if (is_good(answer)) return done();
    set_wrong(login_refusal(answer, say));
  };
  return (
    <form class="panel login" onSubmit={submit}>
      <h2>{say("login.title")}</h2>
      <p>{say("login.do")}</p>
      <label>
        {say("login.token")}
        <input name="token" type="password" autocomplete="current-password" required value={token}
               onInput={(event) => set_token(event.currentTarget.value)} />
      </label>
      {wrong !== "" && <p class="refused" role="alert">{wrong}</p>}
      <button type="submit" class="go">{say("login.send")}</button>
    </form>
  );
}
