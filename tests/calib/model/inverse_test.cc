// Joint angles for a pose, inside the limits, and the duration of a move.

#include "calib/model/inverse.h"

#include <gtest/gtest.h>

#include "calib/files/files.h"
#include "calib/model/units.h"
#include "tests/calib/model/random_arm.h"

namespace cellcal::calib {
namespace {

constexpr double kInverseMargin = 0.05;

double rotation_error(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return Eigen::AngleAxisd(a.linear() * b.linear().transpose()).angle();
}

JointVector within_limits(const Robot& robot, Random& random, double margin) {
  JointVector q;
  for (const Joint& joint : robot.joints)
    q.push_back(random.uniform(joint.min_rad + margin, joint.max_rad - margin));
  return q;
}

/// Share of poses found from a start at `off_rad` from a valid posture; checks each.
double found_share(const ArmModel& arm, Random& random, int poses, double off_rad) {
  int found = 0;
  for (int k = 0; k < poses; ++k) {
    const JointVector truth = within_limits(arm.robot(), random, kInverseMargin + 0.01);
    JointVector seed = truth;
    for (std::size_t i = 0; i < seed.size(); ++i)
      seed[i] = std::clamp(seed[i] + random.uniform(-off_rad, off_rad),
                           arm.robot().joints[i].min_rad, arm.robot().joints[i].max_rad);
    const Eigen::Isometry3d pose = arm.nominal_tcp(truth);
    const auto q = inverse(arm, pose, seed, kInverseMargin);
    if (!q) continue;
    ++found;
    EXPECT_LT((arm.nominal_tcp(*q).translation() - pose.translation()).norm(), 1e-9);
    EXPECT_LT(rotation_error(arm.nominal_tcp(*q), pose), 1e-9 + 1e-12);
    for (std::size_t i = 0; i < q->size(); ++i) {
      EXPECT_GE((*q)[i], arm.robot().joints[i].min_rad + kInverseMargin);
      EXPECT_LE((*q)[i], arm.robot().joints[i].max_rad - kInverseMargin);
    }
  }
  return static_cast<double>(found) / poses;
}

ArmModel shipped(const std::string& name) {
  Tool tool;
  tool.tcp.translation() = Eigen::Vector3d(0.06, 0.05, 0.41);
  return {load_robot(CELLCAL_ROBOTS_FOLDER "/" + name), tool};
}

TEST(Inverse, ReachesRandomPosesOfShippedArmsFromNearby) {
  Random random(1);
  for (const char* name : {"kr5_r1400.toml", "kr16_r2010_2.toml", "kr210_r2700_2.toml"})
    EXPECT_GE(found_share(shipped(name), random, 300, 0.2), 0.95) << name;
}

TEST(Inverse, ReachesRandomPosesOfSevenJointArms) {
  Random random(2);
  // It finds one of many postures near the start, which may be outside a limit.
  for (const char* name : {"iiwa14.toml", "panda.toml"})
    EXPECT_GE(found_share(shipped(name), random, 300, 0.2), 0.9) << name;
}

TEST(Inverse, ReachesRandomPosesOfArmsThatNobodyBuilds) {
  Random random(3);
  double sum = 0.0;
  constexpr int kArms = 50;
  for (int k = 0; k < kArms; ++k) {
    const auto drawn = testing::random_six_axis_arm(random);
    sum += found_share(ArmModel(drawn.robot, drawn.tool), random, 10, 0.2);
  }
  EXPECT_GE(sum / kArms, 0.95);
}

TEST(Inverse, OfThePoseWhereTheArmStandsIsWhereItStands) {
  Random random(4);
  const ArmModel arm = shipped("kr5_r1400.toml");
  for (int k = 0; k < 100; ++k) {
    const JointVector q = within_limits(arm.robot(), random, kInverseMargin);
    const auto found = inverse(arm, arm.nominal_tcp(q), q, kInverseMargin);
    ASSERT_TRUE(found);
    EXPECT_EQ(*found, q);
  }
}

TEST(Inverse, HasNoneForAPoseOutOfReach) {
  const ArmModel arm = shipped("kr5_r1400.toml");
  Eigen::Isometry3d far = Eigen::Isometry3d::Identity();
  far.translation() = Eigen::Vector3d(3.0, 0.0, 1.0);
  EXPECT_FALSE(inverse(arm, far, JointVector{0, -1.2, 1.6, 0, 1, 0}, 0.0));
}

TEST(Inverse, HasNoneForAPoseInsideTheMarginOfALimit) {
  Random random(5);
  const ArmModel arm = shipped("kr5_r1400.toml");
  for (std::size_t joint = 0; joint < 6; ++joint) {
    JointVector q = {0.1, -1.2, 1.6, 0.2, 1.0, 0.3};
    q[joint] = arm.robot().joints[joint].max_rad - 0.5 * kInverseMargin;
    EXPECT_FALSE(inverse(arm, arm.nominal_tcp(q), q, kInverseMargin)) << joint;
    EXPECT_TRUE(inverse(arm, arm.nominal_tcp(q), q, 0.25 * kInverseMargin)) << joint;
  }
}

TEST(Inverse, ReducesAShortRangeByAQuarterOfItAtMost) {
  const ArmModel shipped_arm = shipped("kr5_r1400.toml");
  Robot robot = shipped_arm.robot();
  robot.joints[5].min_rad = -2.0 * kRadPerDeg;
  robot.joints[5].max_rad = 2.0 * kRadPerDeg;
  const ArmModel arm(robot, shipped_arm.tool());
  JointVector q = {0.1, -1.2, 1.6, 0.2, 1.0, 0.0};
  EXPECT_TRUE(inverse(arm, arm.nominal_tcp(q), q, kInverseMargin));
  q[5] = 1.5 * kRadPerDeg;
  EXPECT_FALSE(inverse(arm, arm.nominal_tcp(q), q, kInverseMargin));
}

TEST(Inverse, HasNoneForAPoseThatIsNotANumber) {
  const ArmModel arm = shipped("kr5_r1400.toml");
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation().x() = std::nan("");
  EXPECT_FALSE(inverse(arm, pose, JointVector{0, -1.2, 1.6, 0, 1, 0}, 0.0));
}

}  // namespace
}  // namespace cellcal::calib
