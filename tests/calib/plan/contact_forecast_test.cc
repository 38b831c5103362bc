// Predicted contacts of planned touches compared with those of the true arm and spheres.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "calib/model/linear.h"
#include "calib/plan/forecast.h"
#include "calib/plan/plan.h"
#include "tests/calib/plan/meet.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;

struct Followed {
  std::vector<double> off_sigmas, sigma_m;  ///< of predicted touches
  int unexpected = 0;
  std::map<std::string, int> unexpected_of;
};

/// Executes a plan's touches in order. `spoil`: replaces the k-th measurement. `late_s`: latch
/// delay, at 10 mm/s.
template <typename Spoil>
Followed follow(std::uint64_t arm, int touches, Spoil spoil, double late_s = 0.0) {
  Cell cell = demo_cell();
  constexpr double kSpeed = 0.010;
  if (late_s > 0.0) cell.latch_delay_sigma_s = late_s;
  const sim::Truth truth = testing::plain_truth(cell, arm);
  PlanOptions options;
  options.fit_touches = touches;
  options.check_touches = 4;
  const Plan plan = make_plan(cell, options);
  ContactForecast forecast(cell);
  Random random(arm);
  std::vector<Touch> made;
  Followed followed;
  for (std::size_t k = 0; k < plan.touches.size(); ++k) {
    const PlannedTouch& planned = plan.touches[k];
    const ExpectedContact expected = forecast.of(plan, k)[k];
    auto met = testing::meet(cell, truth, planned, random);
    if (!met) {
      ADD_FAILURE() << "touch " << k << " misses";
      continue;
    }
    if (late_s > 0.0) {
      met->touch.speed_m_s = kSpeed;
      met->travel_m += kSpeed * late_s;
      const double share = kSpeed * late_s / planned.search_m;
      for (std::size_t i = 0; i < met->touch.joint_rad.size(); ++i)
        met->touch.joint_rad[i] += share * (planned.end[i] - planned.standoff[i]);
    }
    if (expected.sigma_m > 0.0) {
      followed.off_sigmas.push_back((met->travel_m - expected.travel_m) / expected.sigma_m);
      followed.sigma_m.push_back(expected.sigma_m);
    } else {
      ++followed.unexpected;
      ++followed.unexpected_of[planned.target];
    }
    Touch touch = met->touch;
    touch.set = planned.set;
    spoil(k, touch);
    made.push_back(touch);
    forecast.learn(made);
  }
  return followed;
}

/// Sigmas of the last ten touches.
std::vector<double> late_sigmas_m(const Followed& followed) {
  return {followed.sigma_m.end() - 10, followed.sigma_m.end()};
}

double largest(const std::vector<double>& values) {
  return *std::max_element(values.begin(), values.end());
}

constexpr auto kHonest = [](std::size_t, Touch&) {};

TEST(ContactForecasts, IsWithinFiveSigmasAndSoonWithinATenthOfAMillimetre) {
  for (const std::uint64_t arm : {4u, 6u}) {
    const Followed followed = follow(arm, 60, kHonest);
    for (const double off : followed.off_sigmas) EXPECT_LT(std::abs(off), 5.0);
    ASSERT_GE(followed.sigma_m.size(), 40U);
    EXPECT_LT(median(late_sigmas_m(followed)), 1e-4);
    EXPECT_LT(largest(late_sigmas_m(followed)), 2.5e-4);
    // And is not overconfident: the squares of correct sigmas have a mean of 1.
    double squares = 0.0;
    for (const double off : followed.off_sigmas) squares += off * off;
    EXPECT_GT(squares / static_cast<double>(followed.off_sigmas.size()), 0.05);
  }
}

TEST(ContactForecasts, IsOfWhatALateLatchWillSay) {
  const Followed followed = follow(4, 60, kHonest, 0.050);  // half a millimetre deeper
  for (const double off : followed.off_sigmas) EXPECT_LT(std::abs(off), 5.0);
  ASSERT_GE(followed.sigma_m.size(), 40U);
  EXPECT_LT(largest(late_sigmas_m(followed)), 2.5e-4);
}

TEST(ContactForecasts, KnowsNothingOfATargetBeforeFourOfItsTouches) {
  const Followed followed = follow(4, 60, kHonest);
  ASSERT_EQ(followed.unexpected_of.size(), 4U);
  for (const auto& [target, count] : followed.unexpected_of) {
    EXPECT_GE(count, 4) << target;
    EXPECT_LE(count, 8) << target;
  }
}

TEST(ContactForecasts, StaysHonestBehindAGrossTouch) {
  const Followed followed = follow(5, 60, [](std::size_t k, Touch& touch) {
    if (k % 20 == 17) touch.joint_rad[1] += 2e-3;  // some 2 mm
  });
  for (const double off : followed.off_sigmas) EXPECT_LT(std::abs(off), 5.0);
  EXPECT_GE(followed.off_sigmas.size(), 35U);
}

TEST(ContactForecasts, SaysNothingOfTouchesThatAreBehindIt) {
  const Cell& cell = demo_cell();
  PlanOptions options;
  options.fit_touches = 30;
  options.check_touches = 0;
  const Plan plan = make_plan(cell, options);
  const ContactForecast empty(cell);
  for (const ExpectedContact& one : empty.of(plan, 0)) EXPECT_EQ(one.sigma_m, 0.0);

  const sim::Truth truth = testing::plain_truth(cell, 4);
  Random random(4);
  ContactForecast forecast(cell);
  std::vector<Touch> made;
  for (const PlannedTouch& planned : plan.touches)
    made.push_back(testing::meet(cell, truth, planned, random).value().touch);
  forecast.learn(made);
  const std::vector<ExpectedContact> expected = forecast.of(plan, 10);
  ASSERT_EQ(expected.size(), 30U);
  for (std::size_t k = 0; k < 10; ++k) EXPECT_EQ(expected[k].sigma_m, 0.0);
  for (std::size_t k = 10; k < 30; ++k) {
    EXPECT_GT(expected[k].sigma_m, 0.0);
    const double met = testing::meet(cell, truth, plan.touches[k], random).value().travel_m;
    EXPECT_NEAR(expected[k].travel_m, met, 5.0 * expected[k].sigma_m + 2e-4);
  }
  EXPECT_TRUE(forecast.of(plan, 40).size() == 30U);
}

TEST(ContactForecasts, UsesNoCertifiedLengthAndNoStatedCentre) {
  Cell cell = demo_cell();
  PlanOptions options;
  options.fit_touches = 30;
  options.check_touches = 0;
  const Plan plan = make_plan(cell, options);
  const sim::Truth truth = testing::plain_truth(cell, 4);
  Random random(4);
  std::vector<Touch> made;
  for (const PlannedTouch& planned : plan.touches)
    made.push_back(testing::meet(cell, truth, planned, random).value().touch);
  const auto forecast = [&] {
    ContactForecast one(cell);
    one.learn(made);
    return one.of(plan, 20);
  };
  const std::vector<ExpectedContact> right = forecast();
  cell.lengths.front().length_m += 0.003;
  cell.targets.back().centre_sigma_m = 1e-5;
  cell.targets.back().centre_m.z() += 0.003;
  const std::vector<ExpectedContact> wrong = forecast();
  for (std::size_t k = 20; k < 30; ++k)
    EXPECT_NEAR(right[k].travel_m, wrong[k].travel_m, 1e-6) << k;
}

}  // namespace
}  // namespace cellcal::calib
