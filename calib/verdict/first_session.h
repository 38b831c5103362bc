#pragma once
// A first session of a few touches, made to see that the cell works.

#include "calib/problem/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Fewer touches than a calibration begins with.
bool has_only_begun(const Problem& problem);
/// What it has shown, and with how many to go on.
Finding first_session(const Problem& problem);

}  // namespace cellcal::calib
