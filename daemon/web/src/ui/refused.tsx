// Why a request was refused.

import type { Refusal } from "../request";

export const Refused = ({ by: { words, lang } }: { by: Refusal }) =>
  words === "" ? null : <p class="refused" role="alert" lang={lang}>{words}</p>;
