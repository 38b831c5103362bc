#pragma once
// The sentences of a control chart: number first, then what to do.

#include <string>
#include <vector>

#include "calib/result/drift_chart.h"

namespace cellcal::calib {

/// "in control: TCP 0.01 +- 0.04 mm (k=2) off the centre of 31 checks, 41 % of the alarm limit"
std::string state_words(const DriftChart& chart);
/// "creep of 0.048 +- 0.010 mm/month (k=2) since check 41 (2026-03-01), ..."; empty where there is none.
std::string trend_words(const DriftChart& chart);
/// What to do; empty: nothing.
std::string advice_words(const DriftChart& chart);
/// What the limits mean.
std::string limit_words(const DriftChart& chart);
/// All of it, a line each.
std::vector<std::string> words(const DriftChart& chart);

/// "2026-03-01" of seconds since 1970, UTC.
std::string date_words(double time_s);

}  // namespace cellcal::calib
