// A cancelled plan ends at the next poll with Cancelled only; an uncancelled one is unchanged.

#include <gtest/gtest.h>

#include <vector>

#include "calib/files/files.h"
#include "calib/model/long_work.h"
#include "calib/plan/online.h"
#include "calib/plan/plan.h"

namespace cellcal::calib {
namespace {

Cell planned_cell() { return load_cell(CELLCAL_DEMO_CELL); }

PlanOptions few_touches() {
  PlanOptions options;
  options.fit_touches = 24;
  options.check_touches = 4;
  return options;
}

std::vector<JointVector> postures(const Plan& plan) {
  std::vector<JointVector> all;
  for (const PlannedTouch& touch : plan.touches) {
    all.insert(all.end(), touch.transit.begin(), touch.transit.end());
    all.push_back(touch.end);
  }
  return all;
}

/// Number of polls of the computation; cancelled at the n-th, if it has as many.
template <typename Work>
long polls(const Work& work, long called_off_at) {
  long count = 0;
  const Watch watch([&] { return ++count >= called_off_at; });
  work();
  return count;
}
constexpr long kNever = 1L << 60;

/// At the first polls, at the last, and at many between.
template <typename Work>
void expect_called_off_anywhere(const Work& work) {
  const long all = polls(work, kNever);
  ASSERT_GT(all, 100) << "it polls in its loops";
  std::vector<long> places{1, 2, 3, all - 1, all};
  for (int k = 1; k < 12; ++k) places.push_back(all * k / 12);
  for (const long place : places)
    EXPECT_THROW(polls(work, place), Cancelled) << place << " of " << all;
}

TEST(PlanningRequest, IsCalledOffAtAnyPollAndAnotherOneIsTheSameAfterwards) {
  const Cell cell = planned_cell();
  const Plan before = make_plan(cell, few_touches());
  expect_called_off_anywhere([&] { (void)make_plan(cell, few_touches()); });
  EXPECT_EQ(postures(make_plan(cell, few_touches())), postures(before));
}

TEST(PlanningRequest, ThatIsWatchedIsTheSameAsOneThatIsNot) {
  const Cell cell = planned_cell();
  const Plan alone = make_plan(cell, few_touches());
  Plan watched;
  EXPECT_GT(polls([&] { watched = make_plan(cell, few_touches()); }, kNever), 0);
  EXPECT_EQ(postures(watched), postures(alone));
  EXPECT_EQ(watched.predicted_mean_m, alone.predicted_mean_m);
}

TEST(TouchesToAGoal, AreCalledOffAtAnyPollOfTheirPlan) {
  const Cell cell = planned_cell();
  Goal goal;
  goal.most_touches = 24;
  expect_called_off_anywhere([&] { Online(cell, few_touches(), goal); });
}

TEST(PlanningRequest, SaysHowFarItIsStepByStepAndNeverLess) {
  std::vector<WorkDone> told;
  const Watch watch([] { return false; }, [&](const WorkDone& done) { told.push_back(done); });
  (void)make_plan(planned_cell(), few_touches());
  ASSERT_GT(told.size(), 20u);
  EXPECT_LT(told.front().share, 0.05);
  EXPECT_GT(told.back().share, 0.95);
  EXPECT_LE(told.back().share, 1.0);
  EXPECT_EQ(told.front().step, PlanStep::kReach);
  EXPECT_EQ(told.back().step, PlanStep::kWays);
  for (std::size_t i = 1; i < told.size(); ++i) {
    EXPECT_GE(told[i].share, told[i - 1].share);
    EXPECT_GE(told[i].step, told[i - 1].step);
  }
}

TEST(LongComputation, OfTheInnermostWatchEndsWithIt) {
  EXPECT_NO_THROW(poll_cancelled()) << "nobody watches";
  const Watch outer([] { return false; });
  {
    const Watch inner([] { return true; });
    EXPECT_THROW(poll_cancelled(), Cancelled);
  }
  EXPECT_NO_THROW(poll_cancelled());
}

}  // namespace
}  // namespace cellcal::calib
