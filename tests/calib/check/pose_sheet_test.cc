// The sheet of pose accuracy and repeatability compared with the simulated errors.

#include "calib/check/pose_sheet.h"

#include <gtest/gtest.h>

#include <cmath>

#include "calib/check/foresight.h"
#include "calib/model/linear.h"
#include "tests/calib/check/changed_cell.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;

std::vector<Touch> fresh_touches(int check) {
  return testing::make_touches(demo_cell(), testing::truth(),
                               {.fit = 8, .check = check, .seed = 77})
      .touches;
}

TEST(APoseSheet, HasTheDistanceOfEveryHeldOutTouchByTargetAndWhatWasPredicted) {
  const std::vector<Touch> touches = fresh_touches(60);
  const PoseSheet sheet = pose_sheet(testing::calibration(), touches, {});
  ASSERT_EQ(sheet.accuracy.size(), demo_cell().targets.size());
  EXPECT_TRUE(sheet.repeatability.empty());
  int poses = 0;
  double measured = 0.0, predicted = 0.0;
  for (const PoseAccuracy& row : sheet.accuracy) {
    EXPECT_LE(row.mean_m, row.max_m);
    poses += row.poses;
    measured += row.poses * row.mean_m;
    predicted += row.poses * row.predicted_m;
  }
  const auto held_out = std::ranges::count(touches, TouchSet::kCheck, &Touch::set);
  EXPECT_EQ(poses, held_out);
  EXPECT_GT(measured, 0.5 * predicted);
  EXPECT_LT(measured, 2.0 * predicted);
  std::vector<Touch> of_one;
  for (const Touch& touch : touches)
    if (touch.target == "S2" && touch.set == TouchSet::kCheck) of_one.push_back(touch);
  const Eigen::VectorXd off = residuals_m(foreseen_contacts(testing::calibration(), of_one));
  EXPECT_NEAR(sheet.accuracy[1].mean_m, off.cwiseAbs().mean(), 1e-12);
  EXPECT_NEAR(sheet.accuracy[1].max_m, off.cwiseAbs().maxCoeff(), 1e-12);
}

/// A repeated touch; A1 scatters such that the tip scatters by about `sigma_m` along the normal.
std::vector<Touch> repeated(int times, double& sigma_m) {
  const Touch one = fresh_touches(4).front();
  constexpr double kStepRad = 1e-5;
  std::vector<Touch> pair{one, one};
  pair[1].joint_rad[0] += kStepRad;
  const Eigen::VectorXd off = residuals_m(foreseen_contacts(testing::calibration(), pair));
  const double per_rad = (off[1] - off[0]) / kStepRad;
  std::vector<Touch> touches;
  Random random(3);
  sigma_m = std::abs(2e-5 * per_rad);
  for (int i = 0; i < times; ++i) {
    touches.push_back(one);
    touches.back().joint_rad[0] += 2e-5 * random.normal();
  }
  return touches;
}

TEST(APoseSheet, StatesRpOfTouchesRepeatedAtOnePlace) {
  double sigma_m = 0.0;
  const std::vector<Touch> touches = repeated(200, sigma_m);
  const PoseSheet sheet = pose_sheet(testing::calibration(), touches, {});
  ASSERT_EQ(sheet.repeatability.size(), 1u);
  const PoseRepeatability& row = sheet.repeatability[0];
  EXPECT_EQ(row.repeats, 200);
  EXPECT_EQ(row.first, 0u);
  // Normal distribution: mean 0.798 and standard deviation 0.603 of the distances, in sigmas.
  EXPECT_NEAR(row.mean_m / sigma_m, 0.798, 0.1);
  EXPECT_NEAR(row.sigma_m / sigma_m, 0.603, 0.1);
  EXPECT_NEAR(row.rp_m, row.mean_m + 3.0 * row.sigma_m, 1e-15);
  EXPECT_NEAR(row.predicted_m, 2.606 * demo_cell().touch_sigma_m, 0.15 * row.predicted_m);
}

TEST(APoseSheet, LeavesOutWhatItIsToldToAndIsEmptyWithoutRepeatsAndCheckTouches) {
  double sigma_m = 0.0;
  std::vector<Touch> touches = repeated(4, sigma_m);
  for (Touch& touch : touches) touch.set = TouchSet::kFit;
  EXPECT_EQ(pose_sheet(testing::calibration(), touches, {}).repeatability.at(0).repeats, 4);
  EXPECT_EQ(pose_sheet(testing::calibration(), touches, {false, true, false, false})
                .repeatability.at(0)
                .repeats,
            3);
  EXPECT_TRUE(pose_sheet(testing::calibration(), touches, {true, true, false, false}).empty());
  touches.resize(2);
  EXPECT_TRUE(pose_sheet(testing::calibration(), touches, {}).empty());
  Calibration bare = testing::calibration();
  bare.covariance.resize(0, 0);
  EXPECT_TRUE(pose_sheet(bare, fresh_touches(20), {}).empty());
}

}  // namespace
}  // namespace cellcal::calib
