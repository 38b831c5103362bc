#pragma once
// Whether a result may be used, and for what.

#include <span>

#include "calib/model/touch.h"
#include "calib/problem/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Everything but `verdict` must be filled, and gross check touches (held_out.h) marked among the
/// residuals. What withholds stands before what warns and informs.
Verdict judge(const Problem& problem, const Calibration& calibration);

/// Warns, of a result that is published, where a wrong contact that the other touches do not contradict could shift the tip far
/// beyond what is predicted, (99).
void warn_of_unchecked_touch(std::span<const Touch> touches, Calibration& calibration);

}  // namespace cellcal::calib
