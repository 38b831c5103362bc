#pragma once
// Whether a result may be used, and for what.

#include <cstddef>
#include <string_view>
#include <vector>

#include "calib/estimate/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Whether a reason is said of results that may be used, too: no objection.
bool is_note(std::string_view reason);

/// Check touches that are gross errors and not the calibration's: few, far off, and without them it
/// does as it predicts. Needs parameters and covariance.
std::vector<std::size_t> gross_check_touches(const Problem& problem,
                                             const Calibration& calibration);

/// Everything but `verdict` must be filled, and gross check touches marked among the residuals.
Verdict judge(const Problem& problem, const Calibration& calibration);

}  // namespace cellcal::calib
