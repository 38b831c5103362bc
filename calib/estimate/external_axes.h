#pragma once
// External axes as found: direction, scale and carriage motions of a linear unit; the axes of a positioner as
// lines in the arm's base frame, and poses of work on it; with their bounds.

#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <vector>

#include "calib/estimate/region.h"
#include "calib/model/joint_vector.h"
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

/// By the calibration's parameters and covariance; empty without a positioner. A turn of the base
/// moves the lines as it moves the tips: it is taken out of the bounds as of those of positions.
/// `touches`: of the calibration.
std::vector<PositionerLine> positioner_lines(const Calibration& calibration,
                                             std::span<const Touch> touches);

/// PositionerAxis::frame with the axis' errors as found, turned about x and y by what it gives.
Eigen::Isometry3d axis_as_found(const Calibration& calibration, std::size_t axis,
                                const Eigen::Vector3d& give_rad = Eigen::Vector3d::Zero());

/// Turn about x, y and z of its frame by which an axis gives, per moment of gravity (carried_moment_nm).
Eigen::Vector3d give_rad_per_nm(const Calibration& calibration, std::size_t axis);
/// Largest turn by which it gives over the ranges of all axes.
double largest_give_rad(const Calibration& calibration, std::size_t axis);

/// Place in the base frame of what the axes with these angles carry, at most all of them, by the
/// calibration's axes. `outer_rad`: of the axes after them, which load them; empty: 0. Throws
/// std::out_of_range for more angles than it has axes.
Eigen::Isometry3d carried_as_found(const Calibration& calibration,
                                   std::span<const double> positioner_rad,
                                   std::span<const double> outer_rad = {});

/// A pose described in the frame that the positioner's axes with these angles carry.
struct CarriedPose {
  JointVector joint_rad;
  std::vector<double> carrier_rad;
};

TipMoves tip_moves(const ArmModel& arm, const std::vector<CarriedPose>& poses, const double* x_si);

/// Random poses of the nominal tip within 150 mm, per coordinate, of targets that the first `axes`
/// axes carry, in any orientation that the arm reaches, at angles all over the axes' limits. At
/// most `count`; fewer where the arm hardly reaches them, none without such a target. Reproducible.
std::vector<CarriedPose> carried_poses(const ArmModel& arm, const Calibration& calibration,
                                       int axes, int count, unsigned seed);

}  // namespace cellcal::calib
