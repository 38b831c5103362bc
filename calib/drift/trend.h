#pragma once
// Since when and how fast the TCP went off: the step or the linear creep, from any check on, that leaves least.

#include <optional>
#include <vector>

#include "calib/result/drift_chart.h"

namespace cellcal::calib {

/// Of checks in their order, the first of which is never off. None: fewer than two. `noise`: how much they scatter beyond what
/// is stated. `reference_c`: as of the charts.
std::optional<DriftTrend> trend_of(const std::vector<CheckSeen>& checks, double noise,
                                   std::optional<double> reference_c);

}  // namespace cellcal::calib
