#pragma once
// A control chart as phrases, for words in any language; drift_chart.h has the words in English.

#include <vector>

#include "calib/result/drift_chart.h"
#include "calib/words/phrase.h"

namespace cellcal::calib {

/// "in control: TCP 0.01 ± 0.04 mm (k=2) off the centre of 31 checks, 41 % of the alarm limit"
Phrase state_phrase(const DriftChart& chart);
/// "creep of 0.048 ± 0.010 mm/month (k=2) since check 41 (2026-03-01), ..."; empty without a trend.
Phrase trend_phrase(const DriftChart& chart);
/// State, trend, advice, what else is known, and the limits; one per line.
std::vector<Phrase> phrases(const DriftChart& chart);

}  // namespace cellcal::calib
