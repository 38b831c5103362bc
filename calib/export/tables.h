#pragma once
// A calibrated arm as tables that other programs read.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>

#include "calib/export/rigid_arm.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// As ROS 2 drivers load a robot's own kinematics: kinematics: {joint_a1: {x, y, z, roll, pitch, yaw}, ...}
/// in m and rad, flange and tcp behind them. Lines of `comment` stand at its top.
std::string ros_yaml(const JointFrames& frames, const std::string& comment);

/// One row a joint: nominal and calibrated theta offset, d, a, alpha, beta in deg and mm, and the sense.
std::string dh_csv(const RigidArm& nominal, const RigidArm& calibrated);

/// "cellcal.arm/1": per joint its Denavit-Hartenberg parameters and frame with sigmas, compliance, play and gear
/// amplitudes; the tool; how far the rigid part is from the whole. Units in the keys' names.
std::string arm_json(const Calibration& calibration);

// Numbers and names in the texts of other programs, whatever the locale.

/// Comes back bit for bit.
std::string shortest(double value);
/// Three, with blanks between them.
std::string shortest(const Eigen::Vector3d& values);

/// The whole text, blanks about it aside; nothing where it is none, or not finite.
std::optional<double> number(std::string_view text);
std::optional<Eigen::Vector3d> three_numbers(std::string_view text);

/// "A1": "joint_a1".
std::string ros_joint_name(const std::string& name);
/// "joint_a1": "A1"; other names as they are, but for characters that no column of a CSV may be named with.
std::string robot_joint_name(const std::string& name);

}  // namespace cellcal::calib
