// Whole plans for random cells are collision-free, by an independent check. A small share of
// tests/experiments/collisions.

#include "tests/calib/plan/collisions.h"

#include <gtest/gtest.h>

#include "calib/files/files.h"
#include "tests/calib/plan/random_cell.h"

namespace cellcal::calib {
namespace {

using testing::Approach;
using testing::Collisions;
using testing::kPromisedBodyM;
using testing::kPromisedTipM;

/// Clearance of the shaft from the touched sphere and its post on a search line.
constexpr double kShaftM = 0.0024;

TEST(PlansOfRandomCells, HitNothing) {
  constexpr unsigned kSeed = 100;
  int planned = 0;
  for (unsigned seed = kSeed; seed < kSeed + 10; ++seed) {
    const testing::RandomCell made = testing::random_cell(CELLCAL_ROBOTS_FOLDER, seed);
    SCOPED_TRACE("cell " + std::to_string(seed) + ", " + made.robot);
    PlanOptions options;
    options.fit_touches = 12;
    options.check_touches = 3;
    Plan plan;
    try {
      plan = make_plan(made.cell, options);
    } catch (const PlanError&) {
      continue;  // nothing to check without a plan
    }
    ++planned;
    const Approach approach = Collisions(made.cell).of(plan);
    EXPECT_GT(approach.tip.gap_m, kPromisedTipM) << approach.tip.words;
    EXPECT_GT(approach.body.gap_m, kShaftM) << approach.body.words;
    EXPECT_GT(approach.self.gap_m, kPromisedBodyM) << approach.self.words;
  }
  EXPECT_GE(planned, 4);
}

TEST(PlansOfRandomCells, WouldBeSeenToHitABoxOnTheWay) {
  const Cell cell = load_cell(CELLCAL_DEMO_CELL);
  PlanOptions options;
  options.fit_touches = 12;
  options.check_touches = 0;
  const Plan plan = make_plan(cell, options);
  ASSERT_GT(Collisions(cell).of(plan).tip.gap_m, kPromisedTipM);
  Cell with_box = cell;
  const ArmModel arm(cell.robot, cell.tool);
  Obstacle box;
  box.id = "box";
  box.size_m = {0.01, 0.01, 0.01};
  box.frame.translation() = arm.nominal_tip_m(plan.touches[5].clear);
  with_box.obstacles = {box};
  const Approach approach = Collisions(with_box).of(plan);
  EXPECT_LT(approach.tip.gap_m, 0.0);
  EXPECT_NE(approach.tip.words.find("box"), std::string::npos);
  // Also halfway to a touch, without a stop there.
  Plan bare;
  bare.start = {1.2, -1.2, 1.6, 0.0, 1.0, 0.0};
  bare.home = {{-1.2, -1.2, 1.6, 0.0, 1.0, 0.0}};
  const JointVector middle = {0.1, -1.2, 1.6, 0.0, 1.0, 0.0};
  with_box.obstacles[0].frame.translation() =
      arm.shape(arm.prepare(middle), nullptr).flange.translation();
  EXPECT_LT(Collisions(with_box).of(bare).body.gap_m, 0.0);
}

}  // namespace
}  // namespace cellcal::calib
