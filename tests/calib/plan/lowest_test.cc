// Lowest point of a plan, and the floor that would bound it.

#include "calib/plan/lowest.h"

#include <gtest/gtest.h>

#include "calib/files/files.h"
#include "calib/plan/plan.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;

PlanOptions few_near_the_ground() {
  PlanOptions options;
  options.fit_touches = 16;
  options.check_touches = 0;
  return options;
}

/// Spheres of the demonstration cell at the height of the arm's foot, on stands of 100 mm.
Cell low_cell() {
  Cell cell = demo_cell();
  cell.floor_m.reset();
  for (Target& target : cell.targets) {
    target.centre_m.z() = 0.05;
    target.stand_height_m = 0.1;
  }
  return cell;
}

TEST(LowestPoint, OfAPlanWithoutAFloorIsStatedBelowTheFeet) {
  const Cell cell = low_cell();
  EXPECT_NEAR(feet_m(cell), 0.05 - cell.targets[0].diameter_m / 2.0 - 0.1, 1e-9);
  const Plan plan = make_plan(cell, few_near_the_ground());
  const auto low = below_feet(cell, plan);
  ASSERT_TRUE(low);
  EXPECT_LT(low->at_m, feet_m(cell));
  EXPECT_NE(words(phrase(*low)).find("State floor_mm"), std::string::npos) << words(phrase(*low));
}

TEST(LowestPoint, IsNotNamedWithAFloorNorOfAPlanThatStaysAboveTheFeet) {
  Cell cell = low_cell();
  const double feet = feet_m(cell);
  cell.floor_m = feet;
  const Plan plan = make_plan(cell, few_near_the_ground());
  EXPECT_FALSE(below_feet(cell, plan));
  cell.floor_m.reset();
  EXPECT_FALSE(below_feet(cell, plan));
}

TEST(LowestPoint, TheArmsFootCountsWhereAllStandsAreHigher) { EXPECT_EQ(feet_m(demo_cell()), 0.0); }

}  // namespace
}  // namespace cellcal::calib
