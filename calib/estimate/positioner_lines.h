#pragma once
// The axes of a positioner as lines in the arm's base frame, and how well they are known.

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// By the calibration's parameters and covariance; empty without a positioner. A turn of the base
/// moves the lines as it moves the tips: it is taken out of the bounds as of those of positions.
/// `touches`: of the calibration.
std::vector<PositionerLine> positioner_lines(const Calibration& calibration,
                                             std::span<const Touch> touches);

/// PositionerAxis::frame with the axis' errors as found.
Eigen::Isometry3d axis_as_found(const Calibration& calibration, std::size_t axis);

/// Place in the base frame of what the axes with these angles carry, at most all of them, by the
/// calibration's axes. Throws std::out_of_range for more angles than it has axes.
Eigen::Isometry3d carried_as_found(const Calibration& calibration,
                                   std::span<const double> positioner_rad);

}  // namespace cellcal::calib
