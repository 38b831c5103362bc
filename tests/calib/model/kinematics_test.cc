// Forward kinematics compared with hand-computed poses and with a naive chain.

#include "calib/model/kinematics.h"

#include <gtest/gtest.h>

#include "calib/files/files.h"
#include "tests/calib/model/naive_arm.h"
#include "tests/calib/model/random_arm.h"

namespace cellcal::calib {
namespace {

using Eigen::Vector3d;

constexpr double kDeg = std::numbers::pi / 180.0;

JointVector deg(std::initializer_list<double> angles) {
  JointVector q;
  for (const double angle : angles) q.push_back(angle * kDeg);
  return q;
}

/// The KR 5 of the method, its flange as TCP.
const ArmModel& kr5() {
  static const ArmModel arm(load_robot(CELLCAL_ROBOTS_FOLDER "/kr5_r1400.toml"), Tool{});
  return arm;
}

/// Position [mm] and z axis of the flange.
void expect_flange(const JointVector& q, const Vector3d& position_mm, const Vector3d& z) {
  const Eigen::Isometry3d flange = kr5().nominal_tcp(q);
  EXPECT_LT((flange.translation() * 1e3 - position_mm).norm(), 1e-9)
      << flange.translation().transpose() * 1e3;
  EXPECT_LT((flange.linear().col(2) - z).norm(), 1e-12) << flange.linear();
}

TEST(Kr5, WithUpperArmUprightAndForearmLevelTheFlangePointsForward) {
  expect_flange(deg({0, -90, 90, 0, 0, 0}), {880, 0, 1040}, Vector3d::UnitX());
}

TEST(Kr5, StretchedForwardItReachesTheSumOfItsLengths) {
  expect_flange(deg({0, 0, 0, 0, 0, 0}), {180 + 600 + 620 + 80, 0, 400 + 40}, Vector3d::UnitX());
}

TEST(Kr5, APositiveA1TurnsClockwiseSeenFromAbove) {
  expect_flange(deg({90, -90, 90, 0, 0, 0}), {0, -880, 1040}, -Vector3d::UnitY());
}

TEST(Kr5, APositiveA2LowersTheArm) {
  const double before = kr5().nominal_tcp(deg({0, -90, 90, 0, 0, 0})).translation().z();
  EXPECT_LT(kr5().nominal_tcp(deg({0, -80, 90, 0, 0, 0})).translation().z(), before);
}

TEST(Kr5, APositiveA5BendsTheHandDown) {
  expect_flange(deg({0, -90, 90, 0, 90, 0}), {800, 0, 1040 - 80}, -Vector3d::UnitZ());
}

TEST(Kr5, APositiveA4RollsTheBentHandAgainstTheForearmsOwnDirection) {
  // Rotated by 90 deg about -x, a hand that points down points to -y.
  expect_flange(deg({0, -90, 90, 90, 90, 0}), {800, -80, 1040}, -Vector3d::UnitY());
}

TEST(Kr5, A6TurnsTheFlangeAndMovesNothing) {
  expect_flange(deg({0, -90, 90, 0, 90, 77}), {800, 0, 960}, -Vector3d::UnitZ());
}

TEST(ArmModel, IsTheChainMultipliedOutForAnyArmAndAnyErrors) {
  Random random(20261120);
  for (int k = 0; k < testing::kArms; ++k) {
    const auto drawn = testing::random_arm(random);
    const ArmModel arm(drawn.robot, drawn.tool);
    const JointVector q = testing::random_joints(drawn.robot, random);
    const Eigen::VectorXd x = testing::random_errors(arm, random, 3.0);
    const Eigen::Isometry3d expected = testing::naive_tcp(arm, q, x);
    const ArmShape shape = arm.shape(arm.prepare(q), x.data());
    // 1e-6 rad/(N m) on torques that the energy gives to 1e-5 N m: 1e-11 rad at some metres.
    EXPECT_LT((shape.tcp.translation() - expected.translation()).norm(), 2e-10) << "arm " << k;
    EXPECT_LT((shape.tcp.linear() - expected.linear()).norm(), 2e-10) << "arm " << k;
  }
}

TEST(ArmModel, SaysTheSamePositionInEveryWayOfAsking) {
  Random random(2);
  for (int k = 0; k < testing::kArms; ++k) {
    const auto drawn = testing::random_arm(random);
    const ArmModel arm(drawn.robot, drawn.tool);
    const PreparedPose pose = arm.prepare(testing::random_joints(drawn.robot, random));
    const Eigen::VectorXd x = testing::random_errors(arm, random, 3.0);
    Eigen::Matrix3Xd jacobian(3, arm.size());
    const Vector3d plain = arm.position(pose, x.data());
    EXPECT_EQ(plain, arm.shape(pose, x.data()).tcp.translation());
    // Rounding of some metres over some ten products.
    EXPECT_LT((plain - arm.position(pose, x.data(), jacobian)).norm(), 1e-14);
  }
}

TEST(ArmModel, WithoutErrorsIsTheNominalArm) {
  Random random(3);
  for (int k = 0; k < testing::kArms; ++k) {
    const auto drawn = testing::random_arm(random);
    const ArmModel arm(drawn.robot, drawn.tool);
    const JointVector q = testing::random_joints(drawn.robot, random);
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(arm.size());
    EXPECT_EQ(arm.position(arm.prepare(q), nullptr), arm.position(arm.prepare(q), zero.data()));
    EXPECT_EQ(arm.nominal_tcp(q).translation(), arm.position(arm.prepare(q), nullptr));
  }
}

TEST(ArmModel, ItsShapeEndsAtTheFlangeAndBeginsAtTheBase) {
  Random random(4);
  const auto drawn = testing::random_arm(random);
  const ArmModel arm(drawn.robot, drawn.tool);
  const ArmShape shape =
      arm.shape(arm.prepare(testing::random_joints(drawn.robot, random)), nullptr);
  ASSERT_EQ(shape.joint_origin_m.size(), drawn.robot.joints.size() + 1);
  EXPECT_EQ(shape.joint_origin_m.front(), drawn.robot.base_fixed.translation());
  EXPECT_EQ(shape.joint_origin_m.back(), shape.flange.translation());
  EXPECT_LT((shape.flange * drawn.tool.tcp.translation() - shape.tcp.translation()).norm(), 1e-14);
}

TEST(ArmModel, TakesOneToThirtyTwoJointsAndSaysSo) {
  Robot robot;
  EXPECT_THROW(ArmModel(robot, Tool{}), std::invalid_argument);
  robot.joints.resize(32);
  EXPECT_EQ(ArmModel(robot, Tool{}).joint_count(), 32);
  robot.joints.resize(33);
  try {
    const ArmModel arm(robot, Tool{});
    FAIL() << "33 joints were taken";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("33"), std::string::npos) << error.what();
  }
}

TEST(ArmModel, BearsALoadAsAToolOfItsMassWouldBe) {
  Cell cell;
  cell.robot = kr5().robot();
  for (Joint& joint : cell.robot.joints) joint.compliance_sigma_rad_per_nm = 1e-6;
  cell.tool.mass_kg = 1.5;
  cell.tool.com_m = {0.0, 0.02, 0.2};
  cell.loads = {{"full", 4.0, {0.1, -0.05, 0.3}}, {"half", 2.0, {0.1, -0.05, 0.3}}};
  Tool held;
  held.id = "held";
  held.mass_kg = 4.0;
  held.com_m = cell.loads[0].com_m;
  const ArmModel arm(cell), as_tool(cell.robot, cell.tool, {held});
  const JointVector q = deg({10, -70, 80, 20, 40, -30});
  const Eigen::VectorXd bare = arm.prepare(q).factor;
  const Eigen::VectorXd full = arm.prepare(q, 0, arm.load("full")).factor;
  EXPECT_LT((full - as_tool.prepare(q).factor).norm(), 1e-9 * full.norm());
  EXPECT_GT((full - bare).norm(), 0.01 * bare.norm());
  const Eigen::VectorXd half = arm.prepare(q, 0, arm.load("half")).factor;
  EXPECT_LT((half - (bare + full) / 2.0).norm(), 1e-9 * full.norm());
  EXPECT_EQ(arm.prepare(q, 0, arm.load("")).factor, bare);
  EXPECT_THROW((void)arm.load("empty"), std::out_of_range);
}

TEST(ArmModel, RefusesAnglesOfAnotherRobot) {
  EXPECT_THROW((void)kr5().prepare(deg({0, 0, 0, 0, 0})), std::invalid_argument);
  EXPECT_THROW((void)kr5().prepare(deg({0, 0, 0, 0, 0, 0, 0})), std::invalid_argument);
}

TEST(ArmModel, NamesItsParametersInTheOrderOfTheFileThenComplianceGearsAndTool) {
  Robot robot;
  robot.joints.resize(2);
  robot.joints[0].name = "A1";
  robot.joints[0].errors = {JointError::kTheta, JointError::kD};
  robot.joints[0].tolerance_angle_rad = robot.joints[0].tolerance_length_m = 1e-3;
  robot.joints[1] = robot.joints[0];
  robot.joints[1].name = "A2";
  robot.joints[1].errors = {JointError::kBeta, JointError::kA, JointError::kAlpha};
  robot.joints[1].compliance_sigma_rad_per_nm = 1e-6;
  robot.joints[0].harmonics = {1, 3};
  robot.joints[0].harmonic_sigma_rad = 1e-5;
  Tool tool;
  tool.deflection_sigma = 0.003;
  tool.tcp_sigma_m = {1e-3, 0.0, 1e-3};
  const ArmModel arm(robot, tool);
  Cell cell;
  cell.robot = robot;
  cell.tool = tool;
  std::vector<std::string> names, units;
  for (const ArmParameter& p : arm.parameters()) {
    names.push_back(parameter_name(cell, p));
    units.push_back(p.unit);
    EXPECT_GT(p.sigma, 0.0) << names.back();
  }
  EXPECT_EQ(names, (std::vector<std::string>{"A1.theta", "A1.d", "A2.beta", "A2.a", "A2.alpha",
                                             "A2.compliance", "A1.cos1", "A1.sin1", "A1.cos3",
                                             "A1.sin3", "tool.c_t", "tool.x", "tool.z"}));
  EXPECT_EQ(units,
            (std::vector<std::string>{"deg", "mm", "deg", "mm", "deg", "rad/(N m)", "arcsec",
                                      "arcsec", "arcsec", "arcsec", "1/(N m^2)", "mm", "mm"}));
}

TEST(ArmModel, WhatHasNoToleranceIsNoParameter) {
  Random random(5);
  auto drawn = testing::random_arm(random);
  for (Joint& joint : drawn.robot.joints) {
    joint.tolerance_angle_rad = joint.tolerance_length_m = 0.0;
    joint.compliance_sigma_rad_per_nm = joint.harmonic_sigma_rad = joint.play_sigma_rad = 0.0;
    joint.bearing_sigma_rad_per_nm = joint.function_sigma_rad = 0.0;
    joint.waves.clear();
  }
  drawn.tool.deflection_sigma = 0.0;
  drawn.tool.tcp_sigma_m.setZero();
  EXPECT_EQ(ArmModel(drawn.robot, drawn.tool).size(), 0);
}

}  // namespace
}  // namespace cellcal::calib
