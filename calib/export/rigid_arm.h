#pragma once
// The arm of a calibration as rigid links: what kinematic descriptions of other programs can hold.

#include <Eigen/Geometry>
#include <string>
#include <vector>

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

// An arm as ROS and URDF hold it: each joint a fixed frame behind the joint before, then a turn.

struct PlacedJoint {
  std::string name;
  /// From the frame behind the joint before (the base's for the first) to this joint's, at angle 0.
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit, in this joint's frame
  double min_rad = 0.0, max_rad = 0.0, max_speed_rad_s = 0.0;
  // Of the link behind it, in this joint's frame; 0: not stated.
  double mass_kg = 0.0;
  Eigen::Vector3d com_m = Eigen::Vector3d::Zero();
};

struct JointFrames {
  std::vector<PlacedJoint> joints;                           ///< angles are the controller's
  Eigen::Isometry3d flange = Eigen::Isometry3d::Identity();  ///< behind the last joint
  Eigen::Isometry3d tcp = Eigen::Isometry3d::Identity();     ///< behind the flange
};

/// T_i (calib/model/README, (1)) without the turn by the controller's angle, which stands in front of it.
Eigen::Isometry3d behind(const Joint& joint);

/// Each frame in the middle of its joint, z along the Denavit-Hartenberg axis.
JointFrames joint_frames(const RigidArm& arm);

/// The joints of `given`, whose kinematics are those of `nominal`, where `calibrated` has them: each
/// frame stays where it is on its joint's axis. The angle that a frame of `given` is turned by
/// about its axis stays, too. Throws FileError naming the joint whose axis is not the nominal one's.
JointFrames moved_frames(const JointFrames& given, const RigidArm& nominal,
                         const RigidArm& calibrated);

/// In the frame of the base.
Eigen::Isometry3d flange_of(const JointFrames& frames, const std::vector<double>& joint_rad);

/// URDF's fixed axes: R = Rz(yaw) Ry(pitch) Rx(roll). At pitch +-90 deg yaw is 0.
Eigen::Vector3d roll_pitch_yaw(const Eigen::Matrix3d& rotation);
Eigen::Matrix3d rotation_of(const Eigen::Vector3d& roll_pitch_yaw);

// Joint frames as Denavit-Hartenberg parameters (Denavit and Hartenberg 1955), with Hayati's beta
// where an axis is parallel to the next (Hayati 1983).

/// Same forward kinematics, to rounding. Each joint's z goes the way in which its largest component
/// in the base frame, at angle zero, is positive; `sign` carries the rest. Names, limits, speeds and
/// masses as given; errors that may be identified, no tolerances. A joint after which all is fixed
/// keeps the flange where it can; the rest is the robot's fixed flange transform.
Robot robot_of(const JointFrames& frames);

}  // namespace cellcal::calib
