#pragma once
// What an update's outcome means for its calibration: published, or withheld with what was found.

#include "calib/result/calibration.h"

namespace cellcal::calib {

/// `c.update` is filled; replaces the findings.
void judge_update(Calibration& c);

}  // namespace cellcal::calib
