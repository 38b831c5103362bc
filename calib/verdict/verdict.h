#pragma once
// Verdict: permitted use of a result.

#include <span>

#include "calib/estimate/problem.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Requires everything except `verdict`, with gross check touches (held_out.h) marked among the
/// residuals. Withholding findings precede warnings and information.
Verdict judge(const Problem& problem, const Calibration& calibration);

/// Warns about a published result if a wrong contact that the other touches do not contradict could
/// shift the tip far beyond the prediction, (99).
void warn_of_unchecked_touch(std::span<const Touch> touches, Calibration& calibration);

// A first session of a few touches, as a test of the cell.

/// Fewer touches than a calibration requires.
bool has_only_begun(const Problem& problem);
/// Its result, and the recommended number of touches.
Finding first_session(const Problem& problem);

}  // namespace cellcal::calib
