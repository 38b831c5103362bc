#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "calib/files/files.h"
#include "calib/model/inverse.h"
#include "calib/model/units.h"
#include "tests/calib/model/random_arm.h"

namespace cellcal::calib {
namespace {

constexpr double kLimitMargin = 0.02;

std::vector<std::pair<std::string, Robot>> shipped() {
  std::vector<std::pair<std::string, Robot>> robots;
  for (const auto& entry : std::filesystem::directory_iterator(CELLCAL_ROBOTS_FOLDER))
    if (entry.path().extension() == ".toml")
      robots.emplace_back(entry.path().filename().string(), load_robot(entry.path()));
  return robots;
}

Tool bent_tool() {
  Tool tool;
  tool.tcp.translation() = Eigen::Vector3d(0.06, 0.05, 0.41);
  tool.tcp.linear() = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitY()).toRotationMatrix();
  return tool;
}

JointVector within_half_turns(const Robot& robot, Random& random, double margin) {
  JointVector q;
  for (const Joint& joint : robot.joints)
    q.push_back(random.uniform(std::max(joint.min_rad, -std::numbers::pi) + margin,
                               std::min(joint.max_rad, std::numbers::pi) - margin));
  return q;
}

double apart(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.matrix() - b.matrix()).norm();
}

/// Largest difference, modulo whole turns.
double apart(const JointVector& a, const JointVector& b) {
  double worst = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    worst = std::max(worst, std::abs(std::remainder(a[i] - b[i], 2.0 * std::numbers::pi)));
  return worst;
}

TEST(Configurations, OfEveryKukaArmWithSixAxesAreFoundInClosedForm) {
  int arms = 0;
  for (const auto& [name, robot] : shipped()) {
    if (name.rfind("kr", 0) != 0) continue;
    SCOPED_TRACE(name);
    ++arms;
    const ArmModel arm(robot, bent_tool());
    const Configurations configurations(arm, kLimitMargin);
    EXPECT_TRUE(configurations.closed_form());
    Random random(1);
    for (int k = 0; k < 50; ++k) {
      const JointVector q = within_half_turns(robot, random, 0.05);
      const Eigen::Isometry3d pose = arm.nominal_tcp(q);
      const auto all = configurations.reach(pose);
      double nearest = 1e9;
      for (const JointVector& found : all) {
        EXPECT_LT(apart(arm.nominal_tcp(found), pose), 1e-8);
        nearest = std::min(nearest, apart(found, q));
        for (std::size_t i = 0; i < found.size(); ++i) {
          EXPECT_GE(found[i], robot.joints[i].min_rad + kLimitMargin);
          EXPECT_LE(found[i], robot.joints[i].max_rad - kLimitMargin);
        }
      }
      EXPECT_LT(nearest, 1e-6) << k;
      EXPECT_LE(all.size(), 8U);
      for (std::size_t a = 0; a < all.size(); ++a)
        for (std::size_t b = a + 1; b < all.size(); ++b) EXPECT_GT(apart(all[a], all[b]), 1e-6);
    }
  }
  EXPECT_GT(arms, 30);
}

TEST(Configurations, OfAnArmWithWideLimitsAreEightInTheMiddleOfItsWorkspace) {
  Robot robot;
  for (const auto& [name, shipped_robot] : shipped())
    if (name == "kr5_r1400.toml") robot = shipped_robot;
  for (Joint& joint : robot.joints) {
    joint.min_rad = -4.0;
    joint.max_rad = 4.0;
  }
  const ArmModel arm(robot, bent_tool());
  const JointVector q = {0.3, -1.2, 1.6, 0.4, 0.9, -0.5};
  EXPECT_EQ(Configurations(arm, 0.0).reach(arm.nominal_tcp(q)).size(), 8U);
}

TEST(Configurations, OfAnAxisWithAShortRangeAreFoundInTheMiddleOfIt) {
  Robot robot = load_robot(CELLCAL_ROBOTS_FOLDER "/kr5_r1400.toml");
  robot.joints[5].min_rad = -2.0 * kRadPerDeg;
  robot.joints[5].max_rad = 2.0 * kRadPerDeg;
  const ArmModel arm(robot, bent_tool());
  const JointVector q = {0.3, -1.2, 1.6, 0.4, 0.9, 0.0};
  constexpr double kWideMargin = 0.05;
  EXPECT_TRUE(
      std::ranges::any_of(Configurations(arm, kWideMargin).reach(arm.nominal_tcp(q)),
                          [&](const JointVector& found) { return apart(found, q) < 1e-6; }));
}

TEST(Configurations, AreNoneOutOfReach) {
  for (const auto& [name, robot] : shipped()) {
    const ArmModel arm(robot, bent_tool());
    Eigen::Isometry3d far = Eigen::Isometry3d::Identity();
    far.translation() = Eigen::Vector3d(9.0, 0.0, 1.0);
    EXPECT_TRUE(Configurations(arm, kLimitMargin).reach(far).empty()) << name;
  }
}

TEST(Configurations, OfArmsWithoutASphericalWristAreFoundFromSeeds) {
  for (const auto& [name, robot] : shipped()) {
    if (name != "panda.toml" && name != "iiwa14.toml") continue;
    SCOPED_TRACE(name);
    const ArmModel arm(robot, bent_tool());
    const Configurations configurations(arm, kLimitMargin);
    EXPECT_FALSE(configurations.closed_form());
    Random random(2);
    int reached = 0;
    for (int k = 0; k < 20; ++k) {
      const Eigen::Isometry3d pose = arm.nominal_tcp(within_half_turns(robot, random, 0.3));
      const auto all = configurations.reach(pose);
      reached += !all.empty();
      for (const JointVector& q : all) EXPECT_LT(apart(arm.nominal_tcp(q), pose), 1e-8);
    }
    EXPECT_GE(reached, 18);
  }
}

TEST(Configurations, AreTheSameForTheSamePose) {
  Random random(3);
  const auto drawn = testing::random_six_axis_arm(random);
  const ArmModel arm(drawn.robot, drawn.tool);
  const Eigen::Isometry3d pose = arm.nominal_tcp(testing::random_joints(drawn.robot, random));
  const Configurations configurations(arm, 0.0);
  EXPECT_EQ(configurations.reach(pose), configurations.reach(pose));
}

TEST(Configurations, ThatShareAPoseDifferInPostureAndEachIsFoundByItsOwn) {
  for (const auto& [name, robot] : shipped()) {
    if (name.rfind("kr", 0) != 0) continue;
    SCOPED_TRACE(name);
    const ArmModel arm(robot, bent_tool());
    const Configurations configurations(arm, kLimitMargin);
    Random random(2);
    for (int k = 0; k < 20; ++k) {
      const Eigen::Isometry3d pose = arm.nominal_tcp(within_half_turns(robot, random, 0.05));
      const auto all = configurations.reach(pose);
      for (std::size_t a = 0; a < all.size(); ++a) {
        const auto posture = configurations.posture_of(all[a]);
        const auto found = configurations.in_posture(pose, posture);
        ASSERT_TRUE(found);
        EXPECT_LT(apart(*found, all[a]), 1e-6);
        for (std::size_t b = a + 1; b < all.size(); ++b)
          EXPECT_FALSE(posture == configurations.posture_of(all[b]));
      }
    }
  }
}

}  // namespace
}  // namespace cellcal::calib
