#pragma once
// The axes of a positioner as lines in the arm's base frame, and how well they are known.

#include <vector>

#include "calib/result/calibration.h"

namespace cellcal::calib {

/// By the calibration's parameters and covariance; empty without a positioner. A turn of the base
/// moves the lines as it moves the tips: it is taken out of the bounds as of those of positions.
std::vector<PositionerLine> positioner_lines(const Calibration& calibration);

}  // namespace cellcal::calib
