#include "calib/exchange/rigid_arm.h"

#include <algorithm>

#include "calib/model/kinematics.h"
#include "calib/uncertainty/predict.h"
#include "calib/uncertainty/region.h"

namespace cellcal::calib {

namespace {

/// Of what is identified as a deviation.
double deviation(const Calibration& c, const ParameterKey& key) {
  const ParameterResult* found = find(c, key);
  return found == nullptr ? 0.0 : found->nominal + found->correction;
}

}  // namespace

RigidArm nominal_rigid_arm(const Cell& cell) { return {cell.robot, cell.tool.tcp}; }

RigidArm calibrated_rigid_arm(const Calibration& calibration) {
  RigidArm arm = nominal_rigid_arm(calibration.cell);
  for (std::size_t i = 0; i < arm.robot.joints.size(); ++i) {
    Joint& joint = arm.robot.joints[i];
    const auto off = [&](ParameterKind kind) {
      return deviation(calibration, joint_parameter(kind, i));
    };
    joint.offset_rad += off(ParameterKind::kTheta);
    joint.d_m += off(ParameterKind::kD);
    joint.a_m += off(ParameterKind::kA);
    joint.alpha_rad += off(ParameterKind::kAlpha);
    joint.beta_rad += off(ParameterKind::kBeta);
  }
  for (int axis = 0; axis < 3; ++axis)
    arm.tcp.translation()[axis] +=
        deviation(calibration, tool_parameter(ParameterKind::kTcp, 0, axis));
  return arm;
}

RigidPose pose_of(const RigidArm& arm, const std::vector<double>& joint_rad) {
  Tool tool;
  tool.tcp = arm.tcp;
  const ArmModel model(arm.robot, tool);
  const ArmShape shape = model.shape(model.prepare(joint_rad), nullptr);
  return {shape.flange, shape.tcp};
}

LeftOut left_out(const Calibration& calibration) {
  constexpr int kPoses = 1000;
  constexpr unsigned kSeed = 1;
  const RigidArm rigid = calibrated_rigid_arm(calibration);
  Tool tool;
  tool.tcp = rigid.tcp;
  const ArmModel model(rigid.robot, tool);
  const Predictor whole(calibration);
  LeftOut result;
  const auto poses = workspace_poses(model, kPoses, kSeed);
  for (const JointVector& q : poses) {
    const double off_m = (whole.calibrated(q).tcp.translation() - model.nominal_tip_m(q)).norm();
    result.mean_m += off_m / static_cast<double>(poses.size());
    result.max_m = std::max(result.max_m, off_m);
  }
  return result;
}

}  // namespace cellcal::calib
