// Touches to a goal: until it is reached, around failures, and no longer than worthwhile.

#include "calib/plan/online.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "calib/model/linear.h"
#include "calib/model/long_work.h"
#include "calib/model/units.h"
#include "calib/plan/candidates.h"
#include "calib/plan/clearance.h"
#include "calib/plan/forecast.h"
#include "calib/plan/pool.h"
#include "tests/calib/plan/drive.h"
#include "tests/calib/plan/meet.h"
#include "tests/calib/simulate.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;

using testing::drive;
using testing::Driven;
using testing::without_checks;

TEST(Online, EndsWhereTheGoalIsReachedAndAHarderGoalTakesMoreTouches) {
  const Driven easy = drive(demo_cell(), {.u95_m = 0.5e-3});
  EXPECT_TRUE(easy.end.done);
  EXPECT_LE(easy.end.u95_m, 0.5e-3);
  EXPECT_EQ(easy.end.ended, Ended::kGoal);
  const Driven hard = drive(demo_cell(), {.u95_m = 0.3e-3});
  EXPECT_LE(hard.end.u95_m, 0.3e-3);
  EXPECT_GT(hard.made, easy.made);
  EXPECT_LT(hard.made, 150);
}

TEST(Online, TouchesThatStateTheirSpeedLeadToTheGoalLikeOthers) {
  const Goal goal{.u95_m = 0.3e-3};
  const Driven silent = drive(demo_cell(), goal), stated = drive(demo_cell(), goal, nullptr, 0.010);
  EXPECT_LE(stated.end.u95_m, 0.3e-3);
  EXPECT_NEAR(stated.made, silent.made, 0.2 * silent.made);
}

TEST(Online, MakesShortSearchesOnceTheArmIsKnownAndStillMeetsTheSpheres) {
  const Driven driven = drive(demo_cell(), {.u95_m = 0.3e-3});
  EXPECT_LE(driven.failed, 2);  // the first ones of an inaccurate arm may miss
  int known = 0;
  for (const PlannedTouch& touch : driven.touches)
    if (touch.expected_m < 0.005) ++known;
  EXPECT_GE(known, static_cast<int>(driven.touches.size()) - 24);
}

TEST(Online, DoesNotOfferAgainWhatFailed) {
  const Driven driven = drive(demo_cell(), {.u95_m = 0.5e-3}, [](int k) { return k % 5 == 2; });
  EXPECT_TRUE(driven.end.done);
  EXPECT_LE(driven.end.u95_m, 0.5e-3);
  EXPECT_GT(driven.failed, 5);
  std::set<std::pair<std::string, JointVector>> clear;
  for (const PlannedTouch& touch : driven.touches)
    EXPECT_TRUE(clear.emplace(touch.target, touch.clear).second);
}

TEST(Online, DoesNotOfferWhatIsMuchLikeATouchThatFailed) {
  // The obstacle of one touch affects the other.
  const auto fails = [](int k) { return k > 20 && k % 2 == 0; };
  const Driven driven = drive(demo_cell(), {.u95_m = 0.25e-3}, fails);
  constexpr double kBesideRad = 0.14;  // at the stand-off instead of the contact
  int pairs = 0;
  for (std::size_t k = 0; k < driven.touches.size(); ++k)
    for (std::size_t later = k + 1; later < driven.touches.size() && fails(static_cast<int>(k));
         ++later) {
      const PlannedTouch &failed = driven.touches[k], &other = driven.touches[later];
      if (other.target != failed.target) continue;
      ++pairs;
      double off = 0.0;
      for (std::size_t i = 0; i < failed.standoff.size(); ++i)
        off = std::max(off, std::abs(failed.standoff[i] - other.standoff[i]));
      EXPECT_GT(off, kBesideRad) << k << " " << later;
    }
  EXPECT_GT(pairs, 100);
}

TEST(Online, EndsWhereFurtherTouchesNoLongerPay) {
  const Driven driven = drive(testing::one_sphere_cell(), {.u95_m = 0.05e-3, .worth_it = 0.06});
  EXPECT_TRUE(driven.end.done);
  EXPECT_GT(driven.end.u95_m, 0.05e-3);
  EXPECT_EQ(driven.end.ended, Ended::kNoGain);
  EXPECT_LT(driven.made, 150);
}

TEST(Online, EndsAtTheMostTouchesThatWereAllowed) {
  const Driven driven = drive(demo_cell(), {.u95_m = 1e-6, .most_touches = 30, .worth_it = 0.0});
  EXPECT_EQ(driven.made, 30);
  EXPECT_EQ(driven.end.ended, Ended::kMostTouches);
  EXPECT_EQ(driven.begin.ended, std::nullopt);
}

TEST(Online, SaysInWordsWhyItEndedAndNothingBefore) {
  const Goal goal{.u95_m = 0.15e-3};
  Progress progress{.touches = 30, .u95_m = 0.2e-3};
  EXPECT_TRUE(why_ended(progress, goal).empty());
  std::set<std::string> sentences;
  for (const Ended how : {Ended::kGoal, Ended::kMostTouches, Ended::kNoGain, Ended::kNoEstimate,
                          Ended::kAllReachable}) {
    progress.ended = how;
    for (const std::string& code : Language::codes())
      sentences.insert(words(why_ended(progress, goal), *Language::of(code)));
  }
  EXPECT_EQ(sentences.size(), 5U * Language::codes().size());
}

TEST(Online, SaysWhatKeepsItFromTheGoal) {
  Cell cell = demo_cell();
  for (Joint& joint : cell.robot.joints) joint.function_sigma_rad = 40.0 * kRadPerArcsec;
  for (Joint& joint : cell.robot.joints) joint.function_reach_rad = 0.1;
  const Goal goal{.u95_m = 0.01e-3, .most_touches = 25};
  const Driven driven = drive(cell, goal);
  ASSERT_EQ(driven.end.ended, Ended::kMostTouches);
  ASSERT_TRUE(driven.end.missing);
  EXPECT_EQ(driven.end.missing->source, UncertaintySource::kTransmission);
  EXPECT_FALSE(driven.end.missing->joint.empty());
  EXPECT_NE(words(why_ended(driven.end, goal)).find("transmission error of A"), std::string::npos);
  EXPECT_FALSE(drive(demo_cell(), {.u95_m = 0.5e-3}).end.missing);
}

TEST(Online, OffersTheSameTouchUntilToldWhatBecameOfIt) {
  Online online(demo_cell(), without_checks(), {});
  const auto first = online.next({});
  ASSERT_TRUE(first);
  EXPECT_EQ(online.next({})->standoff, first->standoff);
  online.failed();
  EXPECT_NE(online.next({})->standoff, first->standoff);
}

TEST(Forecast, FollowsAPowerLawToItsEnd) {
  std::vector<std::pair<int, double>> bounds;
  for (int n = 20; n <= 50; ++n) bounds.emplace_back(n, 1e-3 / n);
  EXPECT_EQ(touches_by_trend(bounds, 1e-3 / 80, 200), 30);
  EXPECT_EQ(touches_by_trend(bounds, 1e-3 / 800, 200), 200);
  EXPECT_EQ(touches_by_trend(bounds, 1e-3, 200), 1);
  EXPECT_EQ(touches_by_trend({bounds.begin(), bounds.begin() + 7}, 1e-3 / 80, 200), 200);
  for (auto& [n, u95] : bounds) u95 = 1e-3;
  EXPECT_EQ(touches_by_trend(bounds, 1e-4, 200), 200) << "it stands still";
}

TEST(Online, OffersTheSameTouchAgainOnAWayThatIsClearFromWhereTheArmIsThen) {
  const Cell& cell = demo_cell();
  const ArmModel arm(cell.robot, cell.tool);
  const Clearance clearance(cell, arm);
  const sim::Truth truth = testing::plain_truth(cell, 4);
  Online online(cell, without_checks(), {.u95_m = 0.3e-3});
  Random random(9);
  JointVector at;
  std::vector<JointVector> been;
  int ways = 0;
  for (int k = 0; k < 30; ++k) {
    const auto planned = online.next(at).value();
    EXPECT_EQ(online.next(at).value().transit, planned.transit);
    // From the middle of each leg, and from the ends of earlier touches.
    std::vector<JointVector> places = been;
    JointVector last = at.empty() ? planned.transit.front() : at;
    for (const JointVector& next : planned.transit) {
      places.push_back(next);
      for (std::size_t i = 0; i < next.size(); ++i) places.back()[i] = 0.5 * (last[i] + next[i]);
      last = next;
    }
    for (const JointVector& here : places) {
      if (!clearance.clear(here)) continue;
      const auto again = online.next(here).value();
      EXPECT_EQ(again.clear, planned.clear);
      EXPECT_EQ(again.standoff, planned.standoff);
      const JointVector* from = &here;
      for (std::size_t w = 0; w + 1 < again.transit.size(); from = &again.transit[w++]) {
        EXPECT_TRUE(clearance.clear(*from, again.transit[w]));
        ++ways;
      }
    }
    if (k % 4 == 0) been.push_back(planned.clear);
    at = planned.clear;
    if (const auto met = testing::meet(cell, truth, planned, random))
      online.touched(met->touch);
    else
      online.failed();
  }
  EXPECT_GT(ways, 30);
}

TEST(Online, SaysHowManyTouchesAreLeft) {
  const sim::Truth truth = testing::plain_truth(demo_cell(), 6);
  Online online(demo_cell(), without_checks(), {.u95_m = 0.3e-3});
  Random random(7);
  JointVector at;
  std::vector<int> left;
  while (const auto planned = online.next(at)) {
    at = planned->clear;
    const auto met = testing::meet(demo_cell(), truth, *planned, random);
    if (met)
      online.touched(met->touch);
    else
      online.failed();
    if (online.progress().u95_m > 0.0) left.push_back(online.progress().touches_left);
  }
  ASSERT_GT(left.size(), 10U);
  EXPECT_EQ(left.back(), 0);
  // In the middle it is a prediction: excluded model levels shorten the rest.
  const auto half = left.size() / 2;
  const auto rest = static_cast<int>(left.size() - half);
  EXPECT_GT(left[half], rest / 3);
  EXPECT_LT(left[half], 3 * rest);
}

TEST(Online, IsCalledOff) {
  bool off = false;
  const Watch watch([&] { return off; });
  Online online(demo_cell(), without_checks(), {});
  off = true;
  EXPECT_THROW(Online(demo_cell(), without_checks(), {}), Cancelled);
  EXPECT_THROW(online.next({}), Cancelled);
}

TEST(Online, SaysThatTheArmIsEnclosedInsteadOfTryingEveryTouch) {
  // A wall next to the arm, which cannot fold to turn past its edge.
  Cell cell = testing::one_sphere_cell();
  cell.robot.joints[1].min_rad = -1.6;
  cell.robot.joints[2].max_rad = 2.3;
  Obstacle fence;
  fence.id = "fence";
  fence.frame.translation() = Eigen::Vector3d(1.15, 0.45, 0.5);
  fence.size_m = {1.4, 0.01, 4.0};
  cell.obstacles = {fence};
  Online online(cell, without_checks(), {});
  ASSERT_TRUE(online.next({}));
  JointVector outside = middle_posture(cell.robot);
  outside[0] = -1.6;  // KUKA's first joint turns clockwise
  Online from_there(cell, without_checks(), {});
  const auto error = testing::thrown<PlanError>([&] { (void)from_there.next(outside); });
  EXPECT_EQ(error.kind, PlanError::Kind::kArmStands) << error.what();
}

}  // namespace
}  // namespace cellcal::calib
