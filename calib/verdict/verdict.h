#pragma once
// Whether a result may be used, and for what.

#include <span>

#include "calib/estimate/problem.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Everything but `verdict` must be filled, and gross check touches (held_out.h) marked among the
/// residuals. What withholds stands before what warns and informs.
Verdict judge(const Problem& problem, const Calibration& calibration);

/// Warns, of a result that is published, where a wrong contact that the other touches do not contradict could shift the tip far
/// beyond what is predicted, (99).
void warn_of_unchecked_touch(std::span<const Touch> touches, Calibration& calibration);

// A first session of a few touches, made to see that the cell works.

/// Fewer touches than a calibration begins with.
bool has_only_begun(const Problem& problem);
/// What it has shown, and with how many to go on.
Finding first_session(const Problem& problem);

}  // namespace cellcal::calib
