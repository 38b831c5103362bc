#pragma once
// All checks of one calibration as a control chart.

#include <optional>
#include <vector>

#include "calib/result/drift_chart.h"

namespace cellcal::calib {

/// The only judgement of all checks: what a cell, its metrics, its page, its controller and its plant show. It is never better
/// than the newest check: an alarm where that does not hold, unknown instead of in control where it is undecided.
/// `checks`: in their order, of the same touches where they are not left out. Causes of its trend and the advice that needs
/// them are not in it yet: advise().
DriftChart drift_chart(const std::vector<CheckSeen>& checks);

/// 'In control' is said of now: with `now_s` (since 1970, UTC) far behind the newest check that decided something the state
/// becomes kUnknown and the advice to check again. What warns or alarms stays.
void age(DriftChart& chart, double now_s);

/// Sets the advice by state, trend, causes and newest check.
void advise(DriftChart& chart);

/// temp_0: the first temperature that is known of checks which count.
std::optional<double> reference_temperature_c(const std::vector<CheckSeen>& checks);

// Since when and how fast the TCP went off: the step or the linear creep, from any check on, that leaves least.

/// Of checks in their order, the first of which is never off. None: fewer than two. `noise`: how much they scatter beyond what
/// is stated. `reference_c`: as of the charts.
std::optional<DriftTrend> trend_of(const std::vector<CheckSeen>& checks, double noise,
                                   std::optional<double> reference_c);

}  // namespace cellcal::calib
