#pragma once
// A calibrated arm as tables that other programs read.

#include <string>

#include "calib/exchange/joint_frames.h"
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

}  // namespace cellcal::calib
