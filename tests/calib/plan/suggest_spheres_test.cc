// Suggested places of spheres for a region.

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "calib/plan/cell_check.h"
#include "calib/plan/plan.h"
#include "tests/calib/plan/box.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;

PlanOptions few() {
  PlanOptions options;
  options.fit_touches = 24;
  options.check_touches = 0;
  return options;
}

double smallest_distance_m(const Cell& cell) {
  double least = 1e9;
  for (std::size_t k = 0; k < cell.targets.size(); ++k)
    for (std::size_t j = 0; j < k; ++j)
      least = std::min(least, (cell.targets[k].centre_m - cell.targets[j].centre_m).norm());
  return least;
}

TEST(SuggestedPlaces, ServeTheWorkspaceBetterThanSpheresCloseTogether) {
  Cell close = demo_cell();
  for (std::size_t k = 0; k < close.targets.size(); ++k)
    close.targets[k].centre_m = Eigen::Vector3d(0.85 + 0.15 * static_cast<double>(k % 2),
                                                -0.1 + 0.2 * static_cast<double>(k / 2), 0.4);
  for (CertifiedLength& length : close.lengths)
    length.length_m = (close.targets[close.target_index(length.from)].centre_m -
                       close.targets[close.target_index(length.to)].centre_m)
                          .norm();
  const SuggestedSpheres suggested = suggest_spheres(close, few(), 4);
  const Plan today = make_plan(close, few());
  EXPECT_LT(suggested.plan.predicted_mean_m, 0.9 * today.predicted_mean_m);
  EXPECT_EQ(suggested.cell.targets.size(), 4u);
  EXPECT_EQ(suggested.cell.lengths.size(), 6u) << "compared with certified lengths, as today";
  EXPECT_GT(smallest_distance_m(suggested.cell), 0.15 - 1e-9);
  EXPECT_TRUE(faults_of(suggested.cell).empty());
  EXPECT_EQ(suggested.plan.touches.size(), 24u);
}

TEST(SuggestedPlaces, AreNotWhereSomethingStands) {
  Cell blocked = demo_cell();
  blocked.obstacles.push_back(testing::box("wall", {0.9, -0.9, 0.6}, {1.4, 1.0, 1.2}));
  const SuggestedSpheres suggested = suggest_spheres(blocked, few(), 3);
  EXPECT_EQ(suggested.cell.targets.size(), 3u);
  const Eigen::AlignedBox3d wall(Eigen::Vector3d(0.2, -1.4, 0.0), Eigen::Vector3d(1.6, -0.4, 1.2));
  for (const Target& target : suggested.cell.targets)
    EXPECT_GT(wall.exteriorDistance(target.centre_m), target.diameter_m / 2.0)
        << target.centre_m.transpose();
}

TEST(SuggestedPlaces, AreFoundInACellWithAMereWarning) {
  Cell cell = demo_cell();
  cell.touch_sigma_m = 3e-3;
  ASSERT_EQ(faults_of(cell).size(), 1u);
  EXPECT_EQ(suggest_spheres(cell, few(), 3).cell.targets.size(), 3u);
}

TEST(SuggestedPlaces, AreFoundForAnArmOnAPedestal) {
  Cell cell = demo_cell();
  cell.floor_m = -1.5;
  EXPECT_EQ(suggest_spheres(cell, few(), 3).cell.targets.size(), 3u);
}

TEST(SuggestedPlaces, OfACellThatCannotBeRightAreRefusedWithWhatIsWrong) {
  Cell cell = demo_cell();
  cell.tool.tcp.translation() /= 1000.0;
  try {
    suggest_spheres(cell, few(), 3);
    FAIL();
  } catch (const PlanError& error) {
    EXPECT_EQ(error.kind, PlanError::Kind::kCell) << error.what();
  }
}

TEST(SuggestedPlaces, AreRefusedForARegionThatDependsOnThem) {
  PlanOptions options = few();
  options.region = parse_accuracy_region("targets");
  try {
    suggest_spheres(demo_cell(), options, 4);
    FAIL();
  } catch (const PlanError& error) {
    EXPECT_EQ(error.kind, PlanError::Kind::kRequest);
  }
}

}  // namespace
}  // namespace cellcal::calib
