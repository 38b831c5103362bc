// Predicted error over the reach: as the workspace figures, and larger away from the touches.

#include "calib/check/error_map.h"

#include <gtest/gtest.h>

#include "tests/calib/check/changed_cell.h"

namespace cellcal::calib {
namespace {

const Calibration& calibrated() { return testing::calibration(); }

/// Mean over the poses of all cells.
double mean_of(const ErrorMap& map, double ErrorCell::*value) {
  double sum = 0.0;
  int poses = 0;
  for (const ErrorCell& cell : map.cells) {
    sum += cell.poses * (cell.*value);
    poses += cell.poses;
  }
  return sum / poses;
}

TEST(AnErrorMap, AgreesOnTheMeanWithTheFiguresOverTheWorkspace) {
  const auto map = error_map(calibrated());
  ASSERT_TRUE(map);
  EXPECT_GT(map->cells.size(), 30u);
  EXPECT_NEAR(mean_of(*map, &ErrorCell::calibrated_m) / calibrated().predicted_workspace_m, 1.0,
              0.1);
  EXPECT_NEAR(mean_of(*map, &ErrorCell::nominal_m) / calibrated().nominal_workspace_m, 1.0, 0.1);
  for (const ErrorCell& cell : map->cells) {
    EXPECT_GT(cell.r_m, 0.0);
    EXPECT_GE(cell.poses, kLeastPosesOfCell);
    EXPECT_GT(cell.nominal_m, 0.0);
  }
}

TEST(AnErrorMap, IsTheSameEachTimeAndThereIsNoneWithoutCovarianceOrOnALinearUnit) {
  const auto one = error_map(calibrated()), other = error_map(calibrated());
  ASSERT_EQ(one->cells.size(), other->cells.size());
  EXPECT_EQ(one->cells[7].calibrated_m, other->cells[7].calibrated_m);
  Calibration bare = calibrated();
  bare.cell.robot.joints[0].guide = LinearGuide{};
  EXPECT_FALSE(error_map(bare));
  bare = calibrated();
  bare.covariance.resize(0, 0);
  EXPECT_FALSE(error_map(bare));
}

}  // namespace
}  // namespace cellcal::calib
