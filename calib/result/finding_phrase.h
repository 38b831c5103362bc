#pragma once
// Findings, outliers, undetermined directions and model levels as phrases, for words in any language; their own headers
// have the words in English.

#include "calib/result/calibration.h"
#include "calib/result/finding.h"
#include "calib/result/outlier.h"
#include "calib/result/tcp_check.h"
#include "calib/result/unidentifiable.h"
#include "calib/words/phrase.h"

namespace cellcal::calib {

/// "certified length S1-S2: 400.000 mm stated, ..."
Phrase phrase(const Finding& finding);
/// Without the opening ("scope: "), for display under a heading.
Phrase sentence_phrase(const Finding& finding);

/// "tool shifted by 0.31 ± 0.08 mm (k=2) on the flange"
Phrase phrase(const Explanation& explanation);
/// Remedy for a change; empty for none.
Phrase remedy_phrase(const Explanation& change);
/// All sentences of a check, one per line: verdict, remedy, spheres not found, every explanation with its
/// likelihood, and the resolution of the check.
std::vector<Phrase> phrases(const TcpCheck& check);

Phrase phrase(const Outlier& outlier);
Phrase phrase(const Cell& cell, const UnidentifiableDirection& direction);
/// "geometry, tool bending, ..."
Phrase phrase(const Cell& cell, const ModelLevel& level);
/// Reason for the selection of the level: "mean over 24 levels, weighted by evidence. Joint compliance: 0.1 x prior
/// (2 %), ..."; empty for methods without levels.
Phrase reason_phrase(const Calibration& calibration);
/// A calibration's name in files, "session 12 of 2026-11-20"; other text is left as it is.
Phrase calibration_phrase(const std::string& in_file);
/// The level and its reason, as in files.
Phrase level_and_reason_phrase(const Calibration& calibration);

}  // namespace cellcal::calib
