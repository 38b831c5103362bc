#pragma once
// Findings as phrases, for words in any language; finding.h has the words in English.

#include "calib/result/finding.h"
#include "calib/words/phrase.h"

namespace cellcal::calib {

/// "certified length S1-S2: 400.000 mm stated, ..."
Phrase phrase(const Finding& finding);
/// Without the opening ("scope: "), for display under a heading.
Phrase sentence_phrase(const Finding& finding);

}  // namespace cellcal::calib
