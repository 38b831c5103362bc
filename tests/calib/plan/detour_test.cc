// Sampled paths: found if simple ones fail, deterministic, and collision-free.

#include <gtest/gtest.h>

#include "calib/files/files.h"
#include "calib/plan/pool.h"
#include "calib/plan/route.h"
#include "tests/calib/plan/box.h"
#include "tests/calib/plan/collisions.h"

namespace cellcal::calib {
namespace {

using testing::kPromisedBodyM;
using testing::kPromisedTipM;

constexpr double kMarginRad = 0.05;

/// The demo cell with a fence between the resting posture and S4, without a path over a single
/// corner: the arm has to fold before it turns.
Cell fenced() {
  Cell cell = load_cell(CELLCAL_DEMO_CELL);
  cell.targets[1].centre_m = {1.06, -0.05, 0.33};
  cell.obstacles = {testing::box("fence", {1.15, 0.20, 0.5}, {1.4, 0.01, 4.0})};
  return cell;
}

struct Ends {
  JointVector rest, beyond;
};

/// The resting posture, and a stand-off at S4.
Ends ends_of(const Cell& cell, const ArmModel& arm, const Clearance& clearance) {
  PlanOptions options;
  for (const Candidate& c : find_candidates(cell, arm, clearance, options, 20))
    if (cell.targets[c.target].id == "S4")
      return {resting_posture(cell.robot, clearance), c.standoff};
  ADD_FAILURE() << "nothing of S4 can be touched";
  return {};
}

TEST(Detour, FindsAWayWhereTheSimpleOnesFail) {
  const Cell cell = fenced();
  const ArmModel arm = planning_arm(cell);
  const Clearance clearance(cell, arm);
  const auto [rest, beyond] = ends_of(cell, arm, clearance);
  ASSERT_FALSE(clearance.clear(rest, beyond));
  const Detour detour =
      find_detour(cell.robot, clearance, rest, beyond, {.limit_margin_rad = kMarginRad});
  ASSERT_GE(detour.way.size(), 2U);  // the straight move is not clear
  EXPECT_EQ(detour.way.back(), beyond);
  Plan plan;
  plan.start = rest;
  plan.home = detour.way;
  const testing::Approach approach = testing::Collisions(cell).of(plan);
  EXPECT_GT(approach.tip.gap_m, kPromisedTipM) << approach.tip.words;
  EXPECT_GT(approach.body.gap_m, kPromisedBodyM) << approach.body.words;
  EXPECT_GT(approach.self.gap_m, kPromisedBodyM) << approach.self.words;
  for (const JointVector& q : detour.way)
    for (std::size_t i = 0; i < q.size(); ++i) {
      EXPECT_GE(q[i], cell.robot.joints[i].min_rad + kMarginRad);
      EXPECT_LE(q[i], cell.robot.joints[i].max_rad - kMarginRad);
    }
}

TEST(Detour, IsTheSameEveryTime) {
  const Cell cell = fenced();
  const ArmModel arm = planning_arm(cell);
  const Clearance clearance(cell, arm);
  const auto [rest, beyond] = ends_of(cell, arm, clearance);
  const DetourOptions options{.limit_margin_rad = kMarginRad};
  const Detour once = find_detour(cell.robot, clearance, rest, beyond, options);
  const Detour twice = find_detour(cell.robot, clearance, rest, beyond, options);
  EXPECT_EQ(once.way, twice.way);
  EXPECT_EQ(once.steps, twice.steps);
  DetourOptions other = options;
  other.seed = 2;
  EXPECT_NE(find_detour(cell.robot, clearance, rest, beyond, other).way, once.way);
}

TEST(Detour, EndsAfterItsStepsWhereThereIsNoWay) {
  Cell cell = fenced();
  cell.robot.joints[1].min_rad = -1.6;  // it cannot fold to turn past the fence's edge
  cell.robot.joints[2].max_rad = 2.3;
  const ArmModel arm = planning_arm(cell);
  const auto [rest, beyond] = ends_of(cell, arm, Clearance(cell, arm));
  const Detour none =
      find_detour(cell.robot, Clearance(cell, arm), rest, beyond, {.most_steps = 200});
  EXPECT_TRUE(none.way.empty());
  EXPECT_LE(none.steps, 202);
}

TEST(Plan, GoesRoundAFenceThatOnlySamplingFindsAWayRound) {
  const Cell cell = fenced();
  PlanOptions options;
  options.fit_touches = 20;
  options.check_touches = 4;
  const Plan plan = make_plan(cell, options);
  int of_s4 = 0;
  for (const PlannedTouch& touch : plan.touches) of_s4 += touch.target == "S4";
  EXPECT_GE(of_s4, 5);
  const testing::Approach approach = testing::Collisions(cell).of(plan);
  EXPECT_GT(approach.tip.gap_m, kPromisedTipM) << approach.tip.words;
  EXPECT_GT(approach.self.gap_m, kPromisedBodyM) << approach.self.words;
  EXPECT_GT(approach.body.gap_m, 0.0024) << approach.body.words;  // shafts near the touched sphere
  // Deterministic for a seed.
  const Plan again = make_plan(cell, options);
  ASSERT_EQ(again.touches.size(), plan.touches.size());
  for (std::size_t k = 0; k < plan.touches.size(); ++k)
    EXPECT_EQ(again.touches[k].transit, plan.touches[k].transit);
}

}  // namespace
}  // namespace cellcal::calib
