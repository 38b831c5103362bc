// Touches to a goal in a cell with a positioner: batches, each with few turns of its axes.

#include <gtest/gtest.h>

#include "calib/plan/positioner_plan.h"
#include "calib/plan/touch_sequence.h"
#include "tests/calib/positioner_session.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

const testing::PositionerSession& batches_cell() {
  static const testing::PositionerSession one(CELLCAL_POSITIONER_ROBOT, 2e-5);
  return one;
}

/// A complete session, from the waiting posture.
struct BatchesDriven {
  std::vector<Touch> touches;
  int turns = 0, offered = 0;
  Progress progress;
  std::vector<JointVector> home;

  /// `failing`: number of the offered touch that is not made, from 1; 0: none.
  BatchesDriven(const Goal& goal, std::vector<Touch> made, int failing = 0)
      : touches(std::move(made)) {
    PlanOptions options;
    options.check_touches = 3;
    GoalBatches batches(batches_cell().cell, options, goal, touches);
    JointVector from = waiting_posture(batches_cell().cell);
    std::vector<double> stands = {0.0, 0.0};
    while (const auto touch = batches.next(from, false, stands)) {
      const bool turned = touch->positioner_rad != stands;
      EXPECT_EQ(turned, !touch->wait.empty());
      turns += turned;
      ++offered;
      const auto contact = batches_cell().standing().contact(*touch, testing::kBeyondTheLine);
      if (contact && offered != failing) {
        touches.push_back(*contact);
        batches.touched(*contact);
      } else {
        batches.failed();
      }
      from = touch->clear;
      stands = touch->positioner_rad;
    }
    progress = batches.progress();
    home = batches.way_home(from);
  }
  long fitted() const { return std::ranges::count(touches, TouchSet::kFit, &Touch::set); }
};

TEST(GoalBatches, EndAtTheGoalWithTheCheckTouchesAndFewTurns) {
  const Goal goal{.u95_m = 3e-3, .most_touches = 60};
  const BatchesDriven driven(goal, {}, 2);
  EXPECT_EQ(driven.progress.ended, Ended::kGoal);
  EXPECT_TRUE(driven.progress.done && driven.progress.fitted);
  EXPECT_GT(driven.progress.u95_m, 0.0);
  EXPECT_LE(driven.progress.u95_m, goal.u95_m);
  EXPECT_EQ(driven.progress.touches, driven.fitted());
  EXPECT_EQ(static_cast<std::size_t>(driven.offered), driven.touches.size() + 1);
  EXPECT_LT(3 * driven.turns, driven.offered);
  EXPECT_FALSE(driven.home.empty());
}

TEST(GoalBatches, GoOnFromTheTouchesOfAnInterruptedSessionUpToTheMostAllowed) {
  const auto& all = batches_cell().touches;
  const std::vector<Touch> made(all.begin(), all.begin() + 30);
  const Goal goal{.u95_m = 1e-6, .most_touches = 36, .worth_it = 0.0};
  const BatchesDriven driven(goal, made);
  EXPECT_EQ(driven.progress.ended, Ended::kMostTouches);
  EXPECT_GE(driven.progress.touches, 36);
  EXPECT_EQ(driven.offered, driven.progress.touches -
                                std::count_if(made.begin(), made.end(), [](const Touch& touch) {
                                  return touch.set == TouchSet::kFit;
                                }));
  EXPECT_TRUE(driven.progress.missing.has_value());
  EXPECT_NE(words(why_ended(driven.progress, goal)).find("goal 0.001 mm"), std::string::npos);
}

TEST(GoalBatches, InContactOffItsSearchesIsRefused) {
  const Cell& cell = batches_cell().cell;
  const auto& made = batches_cell().touches;
  TouchSequenceOptions options;
  options.goal = {.u95_m = 1e-6, .most_touches = 36};
  const std::vector<double> stands(cell.robot.positioner.size(), 0.0);
  const JointVector waits = waiting_posture(cell);
  TouchSequence sequence(cell, options, {made.begin(), made.begin() + 30});
  ASSERT_TRUE(sequence.next(waits, false, stands));
  const PlanError error =
      testing::thrown<PlanError>([&] { (void)sequence.next(waits, true, stands); });
  EXPECT_EQ(error.kind, PlanError::Kind::kArmStands) << error.what();
}

}  // namespace
}  // namespace cellcal::calib
