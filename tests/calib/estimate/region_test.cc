// The representative poses of the workspace follow the arm, not its base frame; the error predicted
// there includes the gears' ripple, however well the arm is known.

#include "calib/estimate/region.h"

#include <gtest/gtest.h>

#include <numbers>

#include "calib/identify/identify.h"
#include "calib/model/linear.h"
#include "tests/calib/simulate.h"
#include "tests/calib/track_cell.h"

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

TEST(Region, OfATrackerIsSpannedByThePosturesThatItMeasured) {
  Cell cell = testing::demo_cell();
  cell.targets[0].kind = TargetKind::kTracker;
  Touch touch;
  touch.target = cell.targets[0].id;
  touch.joint_rad = JointVector(6, 0.0);
  std::vector<Touch> touches(200, touch);
  for (std::size_t i = 0; i < touches.size(); ++i)
    touches[i].joint_rad[0] = static_cast<double>(i) / 100.0;
  touches[0].set = TouchSet::kCheck;
  std::vector<bool> use(touches.size(), true);
  use[199] = false;
  const auto region = tracker_region(cell, touches, use);
  ASSERT_EQ(region.size(), 60u);
  const auto poses = poses_between(region, 500, 7);
  ASSERT_EQ(poses.size(), 500u);
  for (const JointVector& q : poses) {
    EXPECT_GE(q[0], 0.01);
    EXPECT_LE(q[0], 1.98);
    EXPECT_EQ(q[1], 0.0);
  }
  EXPECT_EQ(poses, poses_between(region, 500, 7));
  EXPECT_TRUE(poses_between({}, 10, 7).empty());

  touches[5].target = cell.targets[1].id;
  EXPECT_TRUE(tracker_region(cell, touches).empty()) << "a sphere was touched, too";
}

TEST(Region, MeanErrorOfAnArmThatIsKnownIsWhatItsJointsAreOff) {
  const Cell& cell = testing::demo_cell();
  const ArmModel arm(cell.robot, cell.tool);
  const auto poses = workspace_poses(arm, 300, 7);
  constexpr double kRippleRad = 2.4e-5;
  const Eigen::VectorXd scale = Eigen::VectorXd::Ones(arm.size()), x = 0.0 * scale;
  const double foreseen = predicted_mean_error_m(aligned_moves(arm, poses, x.data(), scale),
                                                 Eigen::MatrixXd::Zero(arm.size(), arm.size()),
                                                 ripple_variance_m2(arm, poses, kRippleRad));
  Random random(1);
  double sum = 0.0;
  constexpr int kTimes = 20;
  for (int k = 0; k < kTimes; ++k)
    for (const JointVector& q : poses) {
      JointVector off = q;
      for (double& angle : off) angle += kRippleRad * random.normal();
      sum += (arm.nominal_tip_m(off) - arm.nominal_tip_m(q)).norm();
    }
  const double seen = sum / static_cast<double>(kTimes * poses.size());
  EXPECT_NEAR(foreseen, seen, 0.1 * seen);  // directions differ
}

TEST(Region, RippleOfTurningJointsAloneMovesTheTipOfAnArmOnALinearUnit) {
  const Cell on_track = testing::track_cell(CELLCAL_TRACK_ROBOT);
  const ArmModel arm(on_track.robot, on_track.tool);
  const auto poses = workspace_poses(arm, 20, 7);
  const Eigen::VectorXd variance = ripple_variance_m2(arm, poses, 1.0);
  for (std::size_t k = 0; k < poses.size(); ++k)
    EXPECT_NEAR(variance[static_cast<Eigen::Index>(k)] + 1.0,
                arm.nominal_jacobian(poses[k]).topRows<3>().squaredNorm(), 1e-9);
}

TEST(Region, ManyPosesAndFewForeseeTheSameErrorButForTheDraw) {
  const Cell& cell = testing::demo_cell();
  sim::TruthOptions truth;
  truth.gear_arcsec = 10.0;
  const auto made = testing::make_touches(cell, sim::draw_truth(cell, truth), {.fit = 60});
  const Calibration few = identify(cell, made.touches);
  const Calibration many = identify(cell, made.touches, {.region_poses = kStatedPoses});
  EXPECT_NEAR(few.predicted_workspace_m, many.predicted_workspace_m,
              0.15 * many.predicted_workspace_m);
  EXPECT_NEAR(few.predicted_near_targets_m, many.predicted_near_targets_m,
              0.15 * many.predicted_near_targets_m);
  EXPECT_NE(few.predicted_workspace_m, many.predicted_workspace_m);
}

}  // namespace
}  // namespace cellcal::calib
