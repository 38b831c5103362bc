#pragma once
// Whether a result may be used, and for what.

#include "calib/identify/calibration.h"
#include "calib/identify/problem.h"

namespace cellcal::calib {

/// Everything but `verdict` must be filled.
Verdict judge(const Problem& problem, const Calibration& calibration);

}  // namespace cellcal::calib
