#include "calib/exchange/joint_frames.h"

#include <fmt/format.h>

#include <cmath>

#include "calib/model/error.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

/// At all angles zero: in front of each joint, and behind the last.
std::vector<Isometry3d> frames_before(const Robot& robot) {
  std::vector<Isometry3d> frames{robot.base_fixed};
  for (const Joint& joint : robot.joints) frames.push_back(frames.back() * behind(joint));
  return frames;
}

constexpr double kSameM = 1e-5;                     // by the rounding of data sheets
constexpr double kSameRad = 5e-3 * kRadPerDeg;  // 1.5708 for a right angle is 2e-4 deg off

}  // namespace

Isometry3d behind(const Joint& joint) {
  return AngleAxisd(joint.offset_rad, Vector3d::UnitZ()) *
         Translation3d(joint.a_m, 0.0, joint.d_m) * AngleAxisd(joint.alpha_rad, Vector3d::UnitX()) *
         AngleAxisd(joint.beta_rad, Vector3d::UnitY());
}

JointFrames joint_frames(const RigidArm& arm) {
  JointFrames frames;
  Isometry3d before = arm.robot.base_fixed;
  for (const Joint& joint : arm.robot.joints) {
    PlacedJoint& one = frames.joints.emplace_back();
    one.name = joint.name;
    one.origin = before;
    one.axis = joint.sign * Vector3d::UnitZ();
    one.min_rad = joint.min_rad;
    one.max_rad = joint.max_rad;
    one.max_speed_rad_s = joint.max_speed_rad_s;
    one.mass_kg = joint.mass_kg;
    before = behind(joint);
    one.com_m = joint.mass_kg > 0.0 ? Vector3d(before * joint.com_m) : Vector3d::Zero();
  }
  frames.flange = before * arm.robot.flange_fixed;
  frames.tcp = arm.tcp;
  return frames;
}

JointFrames moved_frames(const JointFrames& given, const RigidArm& nominal,
                         const RigidArm& calibrated) {
  const std::size_t joints = nominal.robot.joints.size();
  if (given.joints.size() != joints)
    throw FileError(fmt::format("{} joints turn in its chain, {} in the calibrated robot",
                                given.joints.size(), joints));
  const std::vector<Isometry3d> before = frames_before(nominal.robot);
  JointFrames moved = given;
  Isometry3d link = Isometry3d::Identity();  // the given frame before the joint, all angles zero
  Isometry3d fixed = calibrated.robot.base_fixed;  // from the moved frame before it to the joint's
  for (std::size_t i = 0; i < joints; ++i) {
    const PlacedJoint& one = given.joints[i];
    const Joint& joint = nominal.robot.joints[i];
    link = link * one.origin;
    Isometry3d on_axis = before[i].inverse() * link;  // place_i
    const double off_m = on_axis.translation().head<2>().norm();
    const Vector3d axis = on_axis.linear() * one.axis * joint.sign;
    const double off_rad = std::atan2(axis.head<2>().norm(), axis.z());
    if (!(off_m <= kSameM) || !(off_rad <= kSameRad))
      throw FileError(fmt::format(
          "joint \"{}\": its axis is {:.3f} mm and {:.4f} deg off the axis of {} in the nominal "
          "robot \"{}\" (limits {:.2f} mm, {:.3f} deg). Use the URDF of this robot type, with the controller's zero "
          "and senses of rotation",
          one.name, off_m * kMmPerM, off_rad * kDegPerRad, joint.name, nominal.robot.name,
          kSameM * kMmPerM, kSameRad * kDegPerRad));
    on_axis.translation().head<2>().setZero();  // what rounding left beside the axis
    moved.joints[i].origin = fixed * on_axis;
    // The joint turns about its own z in front of place_i: exactly that, not the given rounding.
    moved.joints[i].axis = joint.sign * (on_axis.linear().transpose() * Vector3d::UnitZ());
    fixed = on_axis.inverse() * behind(calibrated.robot.joints[i]);
  }
  // Where the given URDF's flange is on the nominal robot's, it stays on the calibrated one's.
  const Isometry3d offset =
      (before.back() * nominal.robot.flange_fixed).inverse() * (link * given.flange);
  moved.flange = fixed * calibrated.robot.flange_fixed * offset;
  return moved;
}

Isometry3d flange_of(const JointFrames& frames, const std::vector<double>& joint_rad) {
  Isometry3d at = Isometry3d::Identity();
  for (std::size_t i = 0; i < frames.joints.size(); ++i)
    at = at * frames.joints[i].origin * AngleAxisd(joint_rad.at(i), frames.joints[i].axis);
  return at * frames.flange;
}

Vector3d roll_pitch_yaw(const Eigen::Matrix3d& r) {
  // One after the other, each of what the one before left: right to rounding near pitch +-90 deg, too.
  constexpr double kGimbal = 1e-12;
  const double yaw = std::hypot(r(0, 0), r(1, 0)) < kGimbal ? 0.0 : std::atan2(r(1, 0), r(0, 0));
  const Eigen::Matrix3d rest = AngleAxisd(-yaw, Vector3d::UnitZ()) * r;
  return {std::atan2(-rest(1, 2), rest(1, 1)), std::atan2(-rest(2, 0), rest(0, 0)), yaw};
}

Eigen::Matrix3d rotation_of(const Vector3d& rpy) {
  return (AngleAxisd(rpy[2], Vector3d::UnitZ()) * AngleAxisd(rpy[1], Vector3d::UnitY()) *
          AngleAxisd(rpy[0], Vector3d::UnitX()))
      .toRotationMatrix();
}

}  // namespace cellcal::calib
