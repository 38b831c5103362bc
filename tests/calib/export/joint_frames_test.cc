#include <gtest/gtest.h>

#include <cmath>

#include "calib/estimate/predict.h"
#include "calib/export/rigid_arm.h"
#include "calib/model/error.h"
#include "calib/model/units.h"
#include "tests/calib/export/arms.h"

namespace cellcal::calib::testing {
namespace {

TEST(RigidArmOfCalibration, OfACalibrationWithoutElasticErrorsIsTheWholeModel) {
  const Calibration c = rigid_calibration(1);
  const RigidArm arm = calibrated_rigid_arm(c);
  EXPECT_LT(left_out(c, arm).max_m, 1e-12);
  EXPECT_LT(left_out(c, nearest_rigid_arm(c)).max_m, 1e-11);
  const Predictor predictor(c);
  std::mt19937 random(2);
  for (int k = 0; k < 100; ++k) {
    const auto q = random_joints(arm.robot, random);
    EXPECT_LT(apart_m(pose_of(arm, q).tcp, predictor.calibrated(q).tcp), 1e-12);
    EXPECT_LT(apart_rad(pose_of(arm, q).tcp, predictor.calibrated(q).tcp), 1e-12);
  }
}

TEST(OmittedErrors, IsWhatTheToolsBendingMovesTheTipBy) {
  Calibration c = rigid_calibration(1);
  c.cell.tool.mass_kg = 2.0;
  c.cell.tool.length_m = 0.4;
  c.cell.tool.deflection_sigma = 0.003;
  ParameterResult bending;
  bending.key = tool_parameter(ParameterKind::kDeflection, 0);
  bending.correction = 0.003;
  c.parameters.push_back(bending);
  const double most_m = 0.003 * 2.0 * 0.4 * 0.4 * 0.4 / 3.0 * 9.81;  // tool across gravity
  const OmittedEffects out = left_out(c, calibrated_rigid_arm(c));
  EXPECT_LE(out.max_m, most_m * (1.0 + 1e-9));
  EXPECT_GT(out.max_m, 0.98 * most_m);
  EXPECT_GT(out.mean_m, 0.3 * most_m);
}

TEST(NearestRigidArm, TakesUpMostOfWhatJointsGiveAndTurnsTheTcpAsTheWholeModelDoes) {
  Calibration c = soft_calibration();
  const RigidArm geometry = calibrated_rigid_arm(c), nearest = nearest_rigid_arm(c);
  const OmittedEffects without = left_out(c, geometry), out = left_out(c, nearest);
  EXPECT_GT(without.mean_m, 5e-4);
  EXPECT_LT(out.mean_m, 0.5 * without.mean_m);
  EXPECT_LT(out.max_m, 1.2 * without.max_m);  // the mean counts
  EXPECT_TRUE(nearest.tcp.isApprox(geometry.tcp, 0.0));
  const Predictor whole(c);
  std::mt19937 random(8);
  double off_rad = 0.0, without_rad = 0.0;
  for (int k = 0; k < 100; ++k) {
    const auto q = random_joints(geometry.robot, random);
    off_rad += apart_rad(pose_of(nearest, q).tcp, whole.calibrated(q).tcp);
    without_rad += apart_rad(pose_of(geometry, q).tcp, whole.calibrated(q).tcp);
  }
  EXPECT_LT(off_rad, without_rad);
}

TEST(JointFrames, AgreeWithTheCalibratedArmAtAThousandPoses) {
  const Calibration c = rigid_calibration(3);
  const RigidArm arm = calibrated_rigid_arm(c);
  const JointFrames frames = joint_frames(arm);
  const Predictor predictor(c);
  std::mt19937 random(4);
  for (int k = 0; k < 1000; ++k) {
    const auto q = random_joints(arm.robot, random);
    EXPECT_LT(apart_m(flange_of(frames, q) * frames.tcp, predictor.calibrated(q).tcp), 1e-9);
  }
}

/// Frames displaced along the axes and rotated about them, as in another convention.
JointFrames redrawn(JointFrames frames, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> part(-1.0, 1.0);
  for (std::size_t i = 0; i < frames.joints.size(); ++i) {
    PlacedJoint& one = frames.joints[i];
    const Eigen::Isometry3d by =
        Eigen::Translation3d(0.3 * part(random) * one.axis) *
        Eigen::Quaterniond(rotation_of({part(random), part(random), part(random)}));
    one.origin = one.origin * by;
    one.axis = by.linear().transpose() * one.axis;
    Eigen::Isometry3d& next =
        i + 1 < frames.joints.size() ? frames.joints[i + 1].origin : frames.flange;
    next = by.inverse() * next;
  }
  return frames;
}

TEST(GivenJointFrames, AreMovedToTheCalibratedArmAndStayOnTheirAxes) {
  const Calibration c = rigid_calibration(5);
  const RigidArm nominal = nominal_rigid_arm(c.cell), real = calibrated_rigid_arm(c);
  const JointFrames given = redrawn(joint_frames(nominal), 6);
  const JointFrames moved = moved_frames(given, nominal, real);
  std::mt19937 random(7);
  for (int k = 0; k < 1000; ++k) {
    const auto q = random_joints(real.robot, random);
    EXPECT_LT(apart_m(flange_of(moved, q), pose_of(real, q).flange), 1e-9);
    EXPECT_LT(apart_rad(flange_of(moved, q), pose_of(real, q).flange), 1e-9);
  }
  for (std::size_t i = 0; i < given.joints.size(); ++i) {
    EXPECT_LT(apart_m(given.joints[i].origin, moved.joints[i].origin), 0.02) << i;
    EXPECT_LT((given.joints[i].axis - moved.joints[i].axis).norm(), 1e-9) << i;
  }
}

TEST(GivenJointFrames, WithoutAnyCorrectionStayWhereTheyAre) {
  const RigidArm nominal = nominal_rigid_arm(rigid_calibration(5).cell);
  const JointFrames given = redrawn(joint_frames(nominal), 8);
  const JointFrames moved = moved_frames(given, nominal, nominal);
  for (std::size_t i = 0; i < given.joints.size(); ++i)
    EXPECT_LT((given.joints[i].origin.matrix() - moved.joints[i].origin.matrix()).norm(), 1e-12);
  EXPECT_LT((given.flange.matrix() - moved.flange.matrix()).norm(), 1e-12);
}

TEST(GivenJointFrames, ThatWereRoundedAgreeAsWell) {
  const Calibration c = rigid_calibration(5);
  const RigidArm nominal = nominal_rigid_arm(c.cell), real = calibrated_rigid_arm(c);
  JointFrames given = redrawn(joint_frames(nominal), 6);
  given.joints[2].origin.translation() += Eigen::Vector3d(4e-6, -3e-6, 2e-6);
  given.joints[4].origin.linear() = given.joints[4].origin.linear() * rotation_of({3.7e-6, 0, 0});
  const JointFrames moved = moved_frames(given, nominal, real);
  const std::vector<double> zero(6, 0.0);
  const Eigen::Isometry3d drawn_off =
      pose_of(nominal, zero).flange.inverse() * flange_of(given, zero);
  std::mt19937 random(7);
  for (int k = 0; k < 100; ++k) {
    const auto q = random_joints(real.robot, random);
    EXPECT_LT(apart_m(flange_of(moved, q), pose_of(real, q).flange * drawn_off), 1e-9);
  }
}

std::string refusal(const JointFrames& given, const RigidArm& nominal) {
  try {
    moved_frames(given, nominal, nominal);
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

TEST(GivenJointFrames, OfAnotherArmAreRefusedByTheJointThatDiffers) {
  const RigidArm nominal = nominal_rigid_arm(rigid_calibration(5).cell);
  const JointFrames right = joint_frames(nominal);
  JointFrames other = right;
  other.joints[2].origin.translation().x() += 2e-5;
  EXPECT_NE(refusal(other, nominal).find("joint \"A3\": its axis is 0.020 mm"), std::string::npos)
      << refusal(other, nominal);
  other = right;
  other.joints[3].axis = -other.joints[3].axis;
  EXPECT_NE(refusal(other, nominal).find("joint \"A4\""), std::string::npos);
  other = right;
  other.joints[4].axis = rotation_of({0.0, 2e-4, 0.0}) * other.joints[4].axis;
  EXPECT_NE(refusal(other, nominal).find("joint \"A5\""), std::string::npos);
  other = right;
  other.joints.pop_back();
  EXPECT_NE(refusal(other, nominal).find("5 joints turn"), std::string::npos);
  other = right;
  other.joints[0].origin.translation().x() = std::nan("");
  EXPECT_NE(refusal(other, nominal), "");
}

TEST(RollPitchYaw, ComesBackAlsoWherePitchIsARightAngle) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> angle(-3.0, 3.0);
  for (int k = 0; k < 2000; ++k) {
    const double nearly = std::pow(10.0, -1.0 - k % 17);
    const double pitch =
        k % 2 == 0 ? angle(random) : (k % 4 == 1 ? 1.0 : -1.0) * (M_PI / 2 - nearly);
    const Eigen::Matrix3d r = rotation_of({angle(random), pitch, angle(random)});
    EXPECT_LT((rotation_of(roll_pitch_yaw(r)) - r).norm(), 5e-12) << pitch;
  }
}

}  // namespace
}  // namespace cellcal::calib::testing
