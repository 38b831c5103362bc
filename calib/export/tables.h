#pragma once
// A calibrated arm as tables for other programs.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>

#include "calib/export/rigid_arm.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Kinematics file of ROS 2 drivers: kinematics: {joint_a1: {x, y, z, roll, pitch, yaw}, ...} in m and rad,
/// then flange and tcp, then a positioner's joints from the base. The lines of `comment` form the header.
std::string ros_yaml(const JointFrames& frames, const std::string& comment);

/// What a linear unit adds to its joint `placed`, in the base frame: NAME_motion: {position: [...],
/// x, y, z, roll, pitch, yaw: [...]} in m and rad, the origin of a further frame after that joint, every 10 mm or less.
/// Empty without a unit.
std::string unit_yaml(const Calibration& calibration, const PlacedJoint& placed);

/// One row per joint of the arm, without a linear unit: nominal and calibrated theta offset, d, a, alpha, beta in deg and mm, and
/// the sense of rotation.
std::string dh_csv(const RigidArm& nominal, const RigidArm& calibrated);

/// "cellcal.arm/1" (README.md): all that a program needs to compute the calibrated arm, and the deviation of the nearest
/// rigid arm from it. Keys include the units.
std::string arm_json(const Calibration& calibration);

// Numbers and names in other programs' text formats, independent of the locale.

/// Shortest text that is read back bit for bit.
std::string shortest(double value);
/// Three numbers, separated by spaces.
std::string shortest(const Eigen::Vector3d& values);

/// Parses the whole text, surrounding whitespace ignored; empty if it is not a finite number.
std::optional<double> number(std::string_view text);
/// Three numbers separated by blanks, or by commas alone.
std::optional<Eigen::Vector3d> three_numbers(std::string_view text);

/// "A1": "joint_a1".
std::string ros_joint_name(const std::string& name);
/// "joint_a1": "A1"; other names are unchanged except for characters that a CSV column name may not
/// contain.
std::string robot_joint_name(const std::string& name);

}  // namespace cellcal::calib
