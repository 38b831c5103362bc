#pragma once
// The arm of a calibration as rigid links: what kinematic descriptions of other programs can hold.

#include <Eigen/Geometry>

#include "calib/model/robot.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

struct RigidArm {
  Robot robot;
  Eigen::Isometry3d tcp = Eigen::Isometry3d::Identity();  ///< flange to the first tool's TCP
};

RigidArm nominal_rigid_arm(const Cell& cell);
/// With the geometric corrections in the joints' numbers. Elastic and gear errors are left out.
RigidArm calibrated_rigid_arm(const Calibration& calibration);

/// Flange and TCP in the base frame.
struct RigidPose {
  Eigen::Isometry3d flange, tcp;
};
RigidPose pose_of(const RigidArm& arm, const std::vector<double>& joint_rad);

/// TCP of the whole calibrated model from that of its rigid arm [m], over 1000 poses of the workspace.
struct LeftOut {
  double mean_m = 0.0, max_m = 0.0;
};
LeftOut left_out(const Calibration& calibration);

}  // namespace cellcal::calib
