// The poses that stand for the workspace follow the arm, not the frame that it is told in.

#include "calib/identify/region.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/calib/identify/simulate.h"

namespace cellcal::calib {
namespace {

std::vector<JointVector> poses_with(const Eigen::Isometry3d& base) {
  Cell cell = testing::demo_cell();
  cell.robot.base_fixed = base;
  return workspace_poses(ArmModel(cell.robot, cell.tool), 50, 7);
}

TEST(Region, IsTheSameWhereverAndWhicheverWayUpTheArmStands) {
  const auto here = poses_with(Eigen::Isometry3d::Identity());
  ASSERT_EQ(here.size(), 50u);
  Eigen::Isometry3d base = Eigen::Isometry3d::Identity();
  base.translation() = Eigen::Vector3d(0.4, -2.0, -3.0);
  EXPECT_EQ(poses_with(base), here) << "its foot far below the frame's origin";
  base.linear() = Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()).matrix();
  EXPECT_EQ(poses_with(base), here) << "hung from a ceiling";
}

TEST(Region, OfAnArmThatHardlyReachesAboveItsFootIsBelowIt) {
  Cell cell = testing::demo_cell();
  for (Joint& joint : cell.robot.joints) joint.min_rad = joint.max_rad = 0.0;
  cell.robot.joints[1].min_rad = 1.1;  // upper arm down
  cell.robot.joints[1].max_rad = 1.2;
  const ArmModel arm(cell.robot, cell.tool);
  const auto poses = workspace_poses(arm, 50, 7);
  ASSERT_EQ(poses.size(), 50u);
  for (const JointVector& q : poses) EXPECT_LT(arm.nominal_tip_m(q).z(), 0.0);
}

}  // namespace
}  // namespace cellcal::calib
