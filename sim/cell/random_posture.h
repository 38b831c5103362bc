#pragma once
// Random ways to hold the tool against a surface, for simulated touches.

#include <Eigen/Core>

#include "calib/model/joint_vector.h"
#include "calib/model/random.h"
#include "calib/model/robot.h"

namespace cellcal::sim {

/// TCP orientation (base frame) with the tool's shaft within `cone_rad` about -normal; the roll
/// about it is anything.
Eigen::Matrix3d random_orientation(const calib::Tool& tool, calib::Random& random,
                                   const Eigen::Vector3d& normal, double cone_rad);

/// A start for the inverse: the first axis towards `at` (m, base), elbow bent, the rest at random
/// inside the limits.
calib::JointVector random_posture(const calib::Robot& robot, calib::Random& random,
                                  const Eigen::Vector3d& at);

}  // namespace cellcal::sim
