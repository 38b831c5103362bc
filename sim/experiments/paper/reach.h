#pragma once
// Joint angles that bring the real arm's tip to a point, by Newton's method.

#include <Eigen/Geometry>
#include <optional>
#include <random>
#include <vector>

#include "calib/model/kinematics.h"

namespace cellcal::sim::paper {

/// Joint angles inside the limits with the nominal tip at `tip_m` and the flange orientation
/// `flange`, from random starts; empty if none is found.
std::optional<std::vector<double>> reach_nominal(const calib::ArmModel& model,
                                                 const Eigen::Matrix3d& flange,
                                                 const Eigen::Vector3d& tip_m,
                                                 std::mt19937_64& random);

/// Smallest change of `joint_rad` that puts the tip of the arm with errors `x` exactly (1e-13 m) at
/// `tip_m`; empty if outside the limits.
std::optional<std::vector<double>> reach_exactly(const calib::ArmModel& model, const double* x,
                                                 const Eigen::Vector3d& tip_m,
                                                 std::vector<double> joint_rad);

}  // namespace cellcal::sim::paper
