#pragma once
// A linear unit as found: direction, scale, and the motions of its carriage over its position, with their bounds.

#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <vector>

#include "calib/model/kinematics.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// By the calibration's parameters and covariance; empty without a linear unit. A turn of the base moves
/// the direction as it moves the tips: it is taken out of its bound. `touches`: of the calibration.
std::optional<LinearUnitLine> linear_unit_line(const Calibration& calibration,
                                               std::span<const Touch> touches);

/// The frame after the unit in the base frame, at each position [m]. Requires a linear unit.
std::vector<Eigen::Isometry3d> carriage_as_found(const Calibration& calibration,
                                                 std::span<const double> positions_m);

/// Along, across and above as columns, in the frame before the unit. Requires a linear unit.
Eigen::Matrix3d guide_axes(const Robot& robot);

}  // namespace cellcal::calib
