#pragma once
// Whether a result may be used, and for what.

#include "calib/problem/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Everything but `verdict` must be filled, and gross check touches (held_out.h) marked among the
/// residuals. What withholds stands before what warns and informs.
Verdict judge(const Problem& problem, const Calibration& calibration);

}  // namespace cellcal::calib
