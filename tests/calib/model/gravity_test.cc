// Effects of weight: joint torques compared with the potential energy, and a tool that bends down.

#include <gtest/gtest.h>

#include "calib/model/kinematics.h"
#include "tests/calib/model/naive_arm.h"
#include "tests/calib/model/random_arm.h"

namespace cellcal::calib {
namespace {

using Eigen::Vector3d;

int index_of(const ArmModel& arm, ParameterKind kind, int joint = -1) {
  for (int p = 0; p < arm.size(); ++p) {
    const ArmParameter& parameter = arm.parameters()[static_cast<std::size_t>(p)];
    if (parameter.kind == kind && parameter.joint == joint) return p;
  }
  return -1;
}

/// One horizontal link of 1 m along x that turns about `axis_sign` * y, 10 kg at its end.
ArmModel lever(double axis_sign) {
  Robot robot;
  robot.joints.resize(1);
  Joint& joint = robot.joints[0];
  joint.name = "A1";
  joint.a_m = 1.0;
  joint.mass_kg = 10.0;
  joint.compliance_sigma_rad_per_nm = 1e-6;
  // Joint axis z along -y (turns x up) or y (turns x down).
  robot.base_fixed.linear() =
      Eigen::AngleAxisd(-axis_sign * std::numbers::pi / 2, Vector3d::UnitX()).toRotationMatrix();
  return {robot, Tool{}};
}

TEST(Torque, IsWhatAVirtualTurnGainsFromGravityForAnyArm) {
  // Virtual work: gravity does tau d(theta) = -dV when a joint turns by d(theta).
  Random random(11);
  for (int k = 0; k < testing::kArms; ++k) {
    auto drawn = testing::random_arm(random);
    for (Joint& joint : drawn.robot.joints) joint.compliance_sigma_rad_per_nm = 1e-6;
    const ArmModel arm(drawn.robot, drawn.tool);
    const JointVector q = testing::random_joints(drawn.robot, random);
    const PreparedPose pose = arm.prepare(q);
    const Eigen::VectorXd expected = testing::torque_by_energy_nm(
        drawn.robot, drawn.tool, testing::nominal_theta(drawn.robot, q));
    for (int i = 0; i < arm.joint_count(); ++i)
      EXPECT_NEAR(pose.factor[index_of(arm, ParameterKind::kCompliance, i)], expected[i],
                  1e-5 * std::max(1.0, std::abs(expected[i])))
          << "arm " << k << " joint " << i;
  }
}

TEST(Torque, OfAHorizontalLeverIsItsWeightTimesItsLength) {
  // Axis along y: a positive turn lowers the lever, and so does gravity.
  EXPECT_NEAR(lever(1.0).prepare(JointVector{0.0}).factor[0], 98.1, 1e-9);
  EXPECT_NEAR(lever(-1.0).prepare(JointVector{0.0}).factor[0], -98.1, 1e-9);
}

TEST(Torque, DependsOnThePoseAndNotOnTheSignOfTheAxisAngle) {
  Random random(12);
  auto drawn = testing::random_arm(random);
  for (Joint& joint : drawn.robot.joints) joint.compliance_sigma_rad_per_nm = 1e-6;
  const JointVector q = testing::random_joints(drawn.robot, random);
  const ArmModel arm(drawn.robot, drawn.tool);
  JointVector mirrored = q;
  for (std::size_t i = 0; i < q.size(); ++i) {
    drawn.robot.joints[i].sign = -drawn.robot.joints[i].sign;
    mirrored[i] = -q[i];
  }
  const ArmModel other(drawn.robot, drawn.tool);
  for (int i = 0; i < arm.joint_count(); ++i) {
    const int p = index_of(arm, ParameterKind::kCompliance, i);
    EXPECT_EQ(arm.prepare(q).factor[p], other.prepare(mirrored).factor[p]);
  }
}

TEST(Compliance, LetsAnyArmSinkInTheFieldOfGravity) {
  Random random(13);
  for (int k = 0; k < testing::kArms; ++k) {
    auto drawn = testing::random_arm(random);
    for (Joint& joint : drawn.robot.joints) joint.compliance_sigma_rad_per_nm = 1e-6;
    const ArmModel arm(drawn.robot, drawn.tool);
    const JointVector q = testing::random_joints(drawn.robot, random);
    const PreparedPose pose = arm.prepare(q);
    Eigen::VectorXd theta = testing::nominal_theta(drawn.robot, q);
    const double before = testing::potential_j(drawn.robot, drawn.tool, theta);
    for (int i = 0; i < arm.joint_count(); ++i)
      theta[i] += 1e-7 * pose.factor[index_of(arm, ParameterKind::kCompliance, i)];
    EXPECT_LT(testing::potential_j(drawn.robot, drawn.tool, theta), before) << "arm " << k;
  }
}

TEST(Compliance, MovesTheTipOfTheLeverDownByItsAngle) {
  constexpr double kSoft = 1e-5;  // rad/(N m)
  for (const double axis : {1.0, -1.0}) {
    const ArmModel arm = lever(axis);
    const Vector3d tip = arm.position(arm.prepare(JointVector{0.0}), &kSoft);
    EXPECT_NEAR(tip.z(), -std::sin(98.1 * kSoft), 1e-15) << axis;
  }
}

/// A straight tool of `length` on a flange along `z`, with c_t as its only parameter.
ArmModel cantilever(const Vector3d& z, double length) {
  Robot robot;
  robot.joints.resize(1);
  robot.joints[0].name = "A1";
  robot.base_fixed.linear() =
      Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), z).toRotationMatrix();
  Tool tool;
  tool.tcp.translation() = Vector3d(0, 0, length);
  tool.mass_kg = 2.0;
  tool.length_m = length;
  tool.deflection_sigma = 0.003;
  return {robot, tool};
}

TEST(Bending, OfALevelToolIsTheCantileversFormula) {
  constexpr double kCt = 0.003, kLength = 0.4;
  const ArmModel arm = cantilever(Vector3d::UnitX(), kLength);
  const ArmShape shape = arm.shape(arm.prepare(JointVector{0.3}), &kCt);
  const double force = 2.0 * 9.81;
  EXPECT_NEAR(shape.tcp.translation().z(), -kCt * force * std::pow(kLength, 3) / 3.0, 1e-15);
  EXPECT_NEAR(shape.tcp.translation().x(), kLength, 1e-15);
  // The tip is inclined by the slope of the beam's end.
  const Vector3d z = shape.tcp.linear().col(2);
  EXPECT_NEAR(std::atan2(-z.z(), z.x()), kCt * force * kLength * kLength / 2.0, 1e-12);
}

TEST(Bending, OfAHangingOrStandingToolIsNone) {
  constexpr double kCt = 0.01;
  for (const Vector3d& z : {Vector3d(0, 0, 1), Vector3d(0, 0, -1)}) {
    const ArmModel arm = cantilever(z, 0.4);
    const ArmShape shape = arm.shape(arm.prepare(JointVector{0.3}), &kCt);
    EXPECT_LT((shape.tcp.translation() - 0.4 * z).norm(), 1e-15);
    EXPECT_LT((shape.tcp.linear().col(2) - z).norm(), 1e-12);
  }
}

TEST(Bending, TurnsAndMovesTheTipTowardsGravityWhereverGravityComesFrom) {
  Random random(14);
  for (int k = 0; k < testing::kArms; ++k) {
    auto drawn = testing::random_arm(random);
    drawn.tool.deflection_sigma = 0.003;
    drawn.tool.tcp.linear().setIdentity();
    const ArmModel arm(drawn.robot, drawn.tool);
    const PreparedPose pose = arm.prepare(testing::random_joints(drawn.robot, random));
    Eigen::VectorXd x = Eigen::VectorXd::Zero(arm.size());
    const ArmShape stiff = arm.shape(pose, x.data());
    x[index_of(arm, ParameterKind::kDeflection)] = 0.003;
    const ArmShape bent = arm.shape(pose, x.data());
    const Vector3d down = drawn.robot.gravity_m_s2.normalized();
    const Vector3d moved = bent.tcp.translation() - stiff.tcp.translation();
    EXPECT_GT(moved.dot(down), 0.0) << k;
    EXPECT_NEAR(moved.dot(stiff.flange.linear().col(2)), 0.0, 1e-12) << k;
    EXPECT_GT(bent.tcp.linear().col(2).dot(down), stiff.tcp.linear().col(2).dot(down)) << k;
    // The end of a cantilever under a tip load slopes by 3/2 of deflection over length.
    const Eigen::AngleAxisd turn(bent.tcp.linear() * stiff.tcp.linear().transpose());
    EXPECT_NEAR(turn.angle(), 1.5 * moved.norm() / drawn.tool.length_m, 1e-9) << k;
    EXPECT_EQ(bent.flange.matrix(), stiff.flange.matrix()) << k;
  }
}

TEST(Bending, OnTheCeilingPointsTheOtherWayInTheArmsOwnFrame) {
  constexpr double kCt = 0.003;
  const ArmModel standing = cantilever(Vector3d::UnitX(), 0.4);
  Robot robot = standing.robot();
  robot.gravity_m_s2 = -robot.gravity_m_s2;
  const ArmModel hanging(robot, standing.tool());
  const JointVector q = {0.0};
  EXPECT_NEAR(hanging.position(hanging.prepare(q), &kCt).z(),
              -standing.position(standing.prepare(q), &kCt).z(), 1e-15);
}

TEST(Up, IsAgainstGravityAndZWhereThereIsNone) {
  Robot robot;
  Target target;
  robot.gravity_m_s2 = Vector3d(0.0, 9.81, 0.0);
  EXPECT_EQ(up_of(robot), Vector3d(0.0, -1.0, 0.0));
  robot.gravity_m_s2.setZero();
  EXPECT_EQ(up_of(robot), Vector3d(0.0, 0.0, 1.0));
  EXPECT_EQ(stand_up(robot, target), up_of(robot));
  target.stand_up = Vector3d(1.0, 0.0, 0.0);
  EXPECT_EQ(stand_up(robot, target), target.stand_up);
}

}  // namespace
}  // namespace cellcal::calib
