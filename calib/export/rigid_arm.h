#pragma once
// The arm of a calibration as rigid links, as other programs' kinematic descriptions can represent
// it.

#include <Eigen/Geometry>
#include <optional>
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
/// Geometric corrections are included in the joints' parameters, in the direction of a linear unit, and
/// in the frames of a positioner's axes. Omitted are elastic and gear errors, scales of a positioner's
/// angles, and of a linear unit scale, straightness and turns.
RigidArm calibrated_rigid_arm(const Calibration& calibration);

/// Flange and TCP in the base frame.
struct RigidPose {
  Eigen::Isometry3d flange, tcp;
};
RigidPose pose_of(const RigidArm& arm, const std::vector<double>& joint_rad);

/// Lengths and angles of its joints also take up what they can of the elastic and gear errors: least squares of TCP
/// and direction over 1000 poses of the workspace.
RigidArm nearest_rigid_arm(const Calibration& calibration);

/// Distance between the TCP of the full calibrated model and that of its rigid arm [m], over 1000
/// poses of the workspace.
struct OmittedEffects {
  double mean_m = 0.0, max_m = 0.0;
};
OmittedEffects left_out(const Calibration& calibration, const RigidArm& rigid);
/// Likewise of the linear unit alone, with all else as calibrated: compared with its direction, or with the unit
/// as drawn; 0 without one.
OmittedEffects left_out_of_unit(const Calibration& calibration, bool with_direction);

// An arm as represented in ROS and URDF: each joint is a fixed frame relative to the preceding
// joint, then a rotation.

struct PlacedJoint {
  std::string name;
  /// A linear unit, along `axis` from its place at position 0; _rad are metres.
  bool slides = false;
  /// From the frame after the preceding joint (the base's for the first) to this joint's, at angle
  /// 0.
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit, in this joint's frame
  double min_rad = 0.0, max_rad = 0.0, max_speed_rad_s = 0.0;
  // Mass of the link moved by this joint, in this joint's frame; 0: not stated.
  double mass_kg = 0.0;
  Eigen::Vector3d com_m = Eigen::Vector3d::Zero();
};

struct JointFrames {
  std::vector<PlacedJoint> joints;                           ///< angles are the controller's
  Eigen::Isometry3d flange = Eigen::Isometry3d::Identity();  ///< relative to the last joint
  Eigen::Isometry3d tcp = Eigen::Isometry3d::Identity();     ///< relative to the flange
  /// A positioner's axes, base outwards: a chain of its own from the base.
  std::vector<PlacedJoint> positioner;
};

/// T_i (calib/model/README.md, (1)) without the rotation by the controller's angle, which precedes it.
Eigen::Isometry3d behind(const Joint& joint);

/// Each frame in the middle of its joint, z along the Denavit-Hartenberg axis; of a linear unit x along its
/// travel.
JointFrames joint_frames(const RigidArm& arm);

/// The joints of `given`, whose kinematics are those of `nominal`, at their calibrated places: each
/// frame keeps its position and rotation relative to its joint's axis. Throws FileError naming the
/// first joint whose axis differs from the nominal one's. A linear unit keeps its axis in its frame.
JointFrames moved_frames(const JointFrames& given, const RigidArm& nominal,
                         const RigidArm& calibrated);

/// Flange in the base frame.
Eigen::Isometry3d flange_of(const JointFrames& frames, const std::vector<double>& joint_rad);

/// URDF's fixed-axis angles: R = Rz(yaw) Ry(pitch) Rx(roll). Yaw is 0 at pitch +-90 deg.
Eigen::Vector3d roll_pitch_yaw(const Eigen::Matrix3d& rotation);
Eigen::Matrix3d rotation_of(const Eigen::Vector3d& roll_pitch_yaw);

// Joint frames as Denavit-Hartenberg parameters (Denavit and Hartenberg 1955), with Hayati's beta
// for axes parallel to the next (Hayati 1983).

/// Preserves the forward kinematics to rounding. The largest component of each joint's z, in the
/// base frame at zero angle, is positive; `sign` carries the sense of rotation. Names, limits,
/// speeds and masses are copied; identifiable errors are set, without tolerances. The last joint's
/// frame is the flange if possible; the rest goes to the robot's fixed flange transform. No joint may slide.
Robot robot_of(const JointFrames& frames);

// Zeros and senses in which two descriptions of one arm count their angles: a URDF and the controller's machine
// data. Both have the same axes, in the same base frame, at lengths that may differ.

/// other = sense * this + zero.
struct JointZero {
  int sense = 1;
  double zero_rad = 0.0;  ///< -pi to pi
  bool same() const;      ///< within 0.01 deg
};

struct ZeroComparison {
  std::vector<JointZero> joints;
  double flange_rad = 0.0;  ///< rotation between the flanges' frames that no zero explains
  double aside_m = 0.0;     ///< between the axes, all together: other lengths

  bool same() const;
};

/// The explanation with fewest and smallest differences. Empty: the axes are those of different
/// arms.
std::optional<ZeroComparison> compare_zeros(const JointFrames& arm, const JointFrames& other);

}  // namespace cellcal::calib
