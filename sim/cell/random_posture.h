#pragma once
// Random tool orientations at a surface, for simulated touches.

#include <Eigen/Core>

#include "calib/model/joint_vector.h"
#include "calib/model/linear.h"
#include "calib/model/robot.h"

namespace cellcal::sim {

/// TCP orientation (base frame) with the tool's shaft within `cone_rad` of -normal; the roll about
/// it is uniform.
Eigen::Matrix3d random_orientation(const calib::Tool& tool, calib::Random& random,
                                   const Eigen::Vector3d& normal, double cone_rad);

/// The posture with the carriage of a linear unit opposite to the place [m, base], and the arm's first
/// axis towards it, inside the limits.
calib::JointVector facing(const calib::Robot& robot, calib::JointVector posture,
                          const Eigen::Vector3d& place_m);

/// Start of the inverse kinematics: the first axis towards `at` (m, base), elbow bent, the rest
/// random inside the limits.
calib::JointVector random_posture(const calib::Robot& robot, calib::Random& random,
                                  const Eigen::Vector3d& at);

}  // namespace cellcal::sim
