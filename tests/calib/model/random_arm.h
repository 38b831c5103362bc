#pragma once
// Random arms with every feature of the model.

#include <Eigen/Core>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"

namespace cellcal::calib::testing {

inline constexpr int kArms = 200;  ///< sample size for properties of any arm

struct RandomArm {
  Robot robot;
  Tool tool;
};

/// 3 to 9 joints; about every second joint with compliance, gears and errors of all five kinds.
RandomArm random_arm(Random& random);
/// Six joints with the frame rotations of an industrial arm: reaches all orientations.
RandomArm random_six_axis_arm(Random& random);

JointVector random_joints(const Robot& robot, Random& random);
/// Values of the model's parameters, normal with `sigmas` times their prior sigma.
Eigen::VectorXd random_errors(const ArmModel& arm, Random& random, double sigmas);
Eigen::Isometry3d random_pose(Random& random, double reach_m);
Eigen::Vector3d random_direction(Random& random);

}  // namespace cellcal::calib::testing
