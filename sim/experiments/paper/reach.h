#pragma once
// Joint angles that bring the real arm's tip to a point, by Newton's method.

#include <Eigen/Geometry>
#include <optional>
#include <random>
#include <vector>

#include "calib/model/kinematics.h"

namespace cellcal::sim::paper {

/// Joint angles inside the limits that put the nominal tip at `tip_m` with the flange turned as
/// `flange`, from random starts; nothing when none is found.
std::optional<std::vector<double>> reach_nominal(const calib::ArmModel& model,
                                                 const Eigen::Matrix3d& flange,
                                                 const Eigen::Vector3d& tip_m,
                                                 std::mt19937_64& random);

/// Moves `joint_rad` by the smallest amount that puts the tip of the arm with errors `x` exactly
/// (1e-13 m) at `tip_m`; nothing when that leaves the limits.
std::optional<std::vector<double>> reach_exactly(const calib::ArmModel& model, const double* x,
                                                 const Eigen::Vector3d& tip_m,
                                                 std::vector<double> joint_rad);

}  // namespace cellcal::sim::paper
