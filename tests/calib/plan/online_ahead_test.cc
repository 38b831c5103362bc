// Touches to a goal are planned ahead: about the required number, in an order of short duration, and
// the plan is continued after any interruption.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <set>

#include "calib/model/linear.h"
#include "calib/plan/duration.h"
#include "calib/plan/pool.h"
#include "calib/plan/visit.h"
#include "tests/calib/plan/drive.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::drive;
using testing::Driven;
using testing::without_checks;

/// Duration of the straight moves between consecutive touches.
double straight_s(const std::vector<PlannedTouch>& touches) {
  double sum_s = 0.0;
  for (std::size_t k = 1; k < touches.size(); ++k)
    sum_s += move_s(demo_cell().robot, touches[k - 1].clear, touches[k].standoff, {});
  return sum_s;
}

TEST(OnlineAhead, TakesAboutAsManyAsForeseenEveryTargetsFirstOnesBeforeAnyOtherOnAShortWay) {
  const Driven driven = drive(demo_cell(), {.u95_m = 0.3e-3});
  ASSERT_LE(driven.end.u95_m, 0.3e-3);
  ASSERT_EQ(driven.failed, 0);
  std::printf("%d foreseen, %d made\n", driven.begin.touches_left, driven.made);
  EXPECT_GT(driven.begin.touches_left, driven.made * 2 / 3);
  EXPECT_LT(driven.begin.touches_left, driven.made * 3 / 2);

  std::map<std::string, int> of_target;
  for (std::size_t k = 0; k < 4 * kFirstTouches; ++k) ++of_target[driven.touches[k].target];
  for (const auto& [target, touches] : of_target) EXPECT_EQ(touches, kFirstTouches) << target;

  std::vector<PlannedTouch> any = driven.touches;
  Random random(8);
  for (std::size_t k = any.size(); k > 1; --k) std::swap(any[k - 1], any[random.below(k)]);
  std::printf("%.1f s of straight moves, %.1f s in any order\n", straight_s(driven.touches),
              straight_s(any));
  EXPECT_LT(straight_s(driven.touches), 0.85 * straight_s(any));
}

TEST(OnlineAhead, ForeseesNoMoreThanIsAllowedAndNoFewerThanAnEstimateNeeds) {
  EXPECT_EQ(Online(demo_cell(), without_checks(), {.u95_m = 1e-6, .most_touches = 30})
                .progress()
                .touches_left,
            30);
  EXPECT_EQ(Online(demo_cell(), without_checks(), {.u95_m = 1.0}).progress().touches_left,
            4 * kFirstTouches);
}

TEST(OnlineAhead, ASessionThatGoesOnMakesOnlyWhatIsMissing) {
  const Goal goal{.u95_m = 0.35e-3};
  const Driven whole = drive(demo_cell(), goal);
  // During the first touches, and after them.
  for (const std::size_t made : {std::size_t{9}, whole.measured.size() * 2 / 3}) {
    const std::vector<Touch> before(whole.measured.begin(),
                                    whole.measured.begin() + static_cast<std::ptrdiff_t>(made));
    const Driven rest = drive(demo_cell(), goal, nullptr, 0.0, before);
    EXPECT_LE(rest.end.u95_m, goal.u95_m);
    const auto all = static_cast<double>(before.size()) + rest.made;
    EXPECT_NEAR(all, whole.made, 0.35 * whole.made) << made;
    EXPECT_GT(rest.begin.touches_left, 0);
  }
}

TEST(OnlineAhead, ATargetThatLosesFirstTouchesGetsOthers) {
  const Driven driven = drive(demo_cell(), {.u95_m = 0.4e-3}, [](int k) { return k < 6; });
  EXPECT_EQ(driven.failed, 6);
  EXPECT_LE(driven.end.u95_m, 0.4e-3);
  std::map<std::string, int> of_target;
  for (const Touch& touch : driven.measured) ++of_target[touch.target];
  EXPECT_EQ(of_target.size(), demo_cell().targets.size());
  for (const auto& [target, touches] : of_target) EXPECT_GE(touches, kFirstTouches) << target;
}

TEST(OrderByWays, VisitsEachOnceAndSoonerThanInTheOrderGiven) {
  PlanOptions options;
  Pool pool(demo_cell(), options, 60);
  Random random(2);
  std::vector<ToVisit> todo;
  std::set<std::size_t> drawn;
  while (todo.size() < 25) {
    const std::size_t c = random.below(pool.candidates().size());
    if (pool.connected(c) && drawn.insert(c).second)
      todo.push_back({pool.candidates()[c], TouchSet::kFit});
  }
  const auto seconds = [&](const std::vector<std::size_t>& order) {
    double sum_s = 0.0;
    const Candidate* last = nullptr;
    for (const std::size_t k : order) {
      const JointVector& at = last == nullptr ? pool.middle() : last->clear;
      const auto way = pool.router().to_standoff(at, last, todo[k].candidate);
      EXPECT_TRUE(way);
      if (way) sum_s += way_s(demo_cell().robot, at, *way, {});
      last = &todo[k].candidate;
    }
    return sum_s;
  };
  std::vector<std::size_t> given(todo.size());
  for (std::size_t k = 0; k < given.size(); ++k) given[k] = k;
  std::vector<std::size_t> order =
      order_by_ways(demo_cell().robot, pool.router(), todo, pool.middle(), nullptr);
  const double guessed_s =
      seconds(order_by_ways(demo_cell().robot, pool.router(), todo, pool.middle(), nullptr, 1));
  const double found_s = seconds(order), given_s = seconds(given);
  std::printf("%.1f s, by guessed ways %.1f s, as given %.1f s\n", found_s, guessed_s, given_s);
  EXPECT_LT(found_s, 0.85 * given_s);
  EXPECT_LE(found_s, guessed_s);
  std::sort(order.begin(), order.end());
  EXPECT_EQ(order, given);
}

TEST(OrderByWays, BeginsBesideWhereTheArmIs) {
  PlanOptions options;
  Pool pool(demo_cell(), options, 60);
  // One of each target; the arm is after a touch of one of them, with another next to it.
  std::vector<ToVisit> todo;
  std::map<std::size_t, std::size_t> of_target;
  for (std::size_t c = 0; c < pool.candidates().size(); ++c)
    if (!of_target.contains(pool.candidates()[c].target) && pool.connected(c)) {
      of_target[pool.candidates()[c].target] = c;
      todo.push_back({pool.candidates()[c], TouchSet::kFit});
    }
  ASSERT_EQ(todo.size(), 4U);
  for (std::size_t k = 0; k < todo.size(); ++k) {
    const Candidate& stood = todo[k].candidate;
    const auto order = order_by_ways(demo_cell().robot, pool.router(), todo, stood.clear, &stood);
    EXPECT_EQ(order.front(), k);
  }
}

}  // namespace
}  // namespace cellcal::calib
