#include <gtest/gtest.h>

#include "calib/export/rigid_arm.h"
#include "calib/model/units.h"
#include "tests/calib/export/arms.h"

namespace cellcal::calib::testing {
namespace {

void expect_same_kinematics(const Robot& one, const Robot& other, const std::string& which) {
  std::mt19937 random(11);
  for (int k = 0; k < 50; ++k) {
    const auto q = random_joints(one, random);
    const RigidPose a = pose_of({one, Eigen::Isometry3d::Identity()}, q);
    const RigidPose b = pose_of({other, Eigen::Isometry3d::Identity()}, q);
    ASSERT_LT(apart_m(a.flange, b.flange), 1e-10) << which;
    ASSERT_LT(apart_rad(a.flange, b.flange), 1e-10) << which;
  }
}

TEST(RobotOfJointFrames, HasTheKinematicsOfEveryShippedRobot) {
  const auto robots = shipped_robots();
  ASSERT_GT(robots.size(), 30U);
  for (const NamedRobot& one : robots)
    expect_same_kinematics(
        one.robot, robot_of(joint_frames({one.robot, Eigen::Isometry3d::Identity()})), one.file);
}

TEST(RobotOfJointFrames, OfACalibratedArmHasItsKinematicsToo) {
  const RigidArm arm = calibrated_rigid_arm(rigid_calibration(12));
  expect_same_kinematics(arm.robot, robot_of(joint_frames(arm)), "calibrated");
}

TEST(RobotOfJointFrames, OfTheKR5IsTheShippedFileNumberByNumber) {
  const Robot shipped = kr5();
  const Robot again = robot_of(joint_frames({shipped, Eigen::Isometry3d::Identity()}));
  ASSERT_EQ(again.joints.size(), shipped.joints.size());
  for (std::size_t i = 0; i < shipped.joints.size(); ++i) {
    const Joint &a = shipped.joints[i], &b = again.joints[i];
    EXPECT_EQ(a.sign, b.sign) << a.name;
    EXPECT_NEAR(std::cos(a.offset_rad - b.offset_rad), 1.0, 1e-12) << a.name;
    EXPECT_NEAR(a.d_m, b.d_m, 1e-12) << a.name;
    EXPECT_NEAR(a.a_m, b.a_m, 1e-12) << a.name;
    EXPECT_NEAR(a.alpha_rad, b.alpha_rad, 1e-12) << a.name;
    EXPECT_NEAR(b.beta_rad, 0.0, 1e-12) << a.name;
    EXPECT_EQ(a.errors, b.errors) << a.name;
    EXPECT_EQ(a.min_rad, b.min_rad);
    EXPECT_EQ(a.max_speed_rad_s, b.max_speed_rad_s);
  }
  EXPECT_TRUE(again.flange_fixed.isApprox(shipped.flange_fixed));
}

TEST(RobotOfJointFrames, KeepsMassesWhereTheyAre) {
  Robot shipped = kr5();
  for (Joint& joint : shipped.joints) {
    joint.mass_kg = 10.0;
    joint.com_m << 0.01, -0.02, 0.03;
  }
  const Robot again = robot_of(joint_frames({shipped, Eigen::Isometry3d::Identity()}));
  for (std::size_t i = 0; i < shipped.joints.size(); ++i) {
    EXPECT_EQ(again.joints[i].mass_kg, 10.0);
    EXPECT_LT((again.joints[i].com_m - shipped.joints[i].com_m).norm(), 1e-12) << i;
  }
}

TEST(RobotOfJointFrames, TakesAxesThatRoundingTiltedForParallel) {
  Robot shipped = kr5();
  JointFrames frames = joint_frames({shipped, Eigen::Isometry3d::Identity()});
  frames.joints[2].origin.linear() =
      frames.joints[2].origin.linear() * rotation_of({3.7e-6, 0.0, 0.0});
  const Robot robot = robot_of(frames);
  EXPECT_NEAR(robot.joints[1].a_m, 0.6, 1e-5);
  EXPECT_EQ(robot.joints[1].d_m, 0.0);
  EXPECT_EQ(robot.joints[1].errors.back(), JointError::kBeta);
  std::mt19937 random(13);
  for (int k = 0; k < 50; ++k) {
    const auto q = random_joints(shipped, random);
    EXPECT_LT(
        apart_m(pose_of({robot, Eigen::Isometry3d::Identity()}, q).flange, flange_of(frames, q)),
        1e-10);
  }
}

}  // namespace
}  // namespace cellcal::calib::testing
