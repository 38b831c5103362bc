// Advice from checks as the number read by a robot program.

#include <gtest/gtest.h>

#include "calib/check/drift.h"
#include "daemon/controller/advice_publisher.h"

namespace cellcal::daemon {
namespace {

constexpr double kDay = 86400.0, kFirst = 1'767'225'600.0;  // 2026-01-01

calib::CheckMeasurement check(int day, bool holds = true,
                              calib::LeftOut out = calib::LeftOut::kNo) {
  calib::CheckMeasurement one;
  one.session = day;
  one.time_s = kFirst + day * kDay;
  one.left_out = out;
  if (out != calib::LeftOut::kUndecided)
    one.verdict = holds ? calib::CheckVerdict::kHolds : calib::CheckVerdict::kDoesNotHold;
  one.covariance_m2 = Eigen::Matrix3d::Identity() * 1e-10;
  if (!holds) one.change = calib::Explanation{.kind = calib::ChangeKind::kTool};
  return one;
}

PublishedAdvice advice_by(const std::vector<calib::CheckMeasurement>& checks, double now_s) {
  calib::DriftChart chart = calib::drift_chart(checks);
  calib::age(chart, now_s);
  return advice_of(chart, now_s);
}

TEST(Advice, IsUnknownWithoutACheck) { EXPECT_EQ(advice_by({}, kFirst), PublishedAdvice()); }

TEST(Advice, HoldsForTwoWeeksBehindACheckThatHeld) {
  const PublishedAdvice advice = advice_by({check(0)}, kFirst + kDay);
  EXPECT_EQ(advice.advice, Advice::kHolds);
  EXPECT_EQ(advice.until_day, 2026 * 372 + 1 * 31 + 15);
}

TEST(Advice, FewChecksSayNothingTwoWeeksLater) {
  EXPECT_EQ(advice_by({check(0)}, kFirst + 13 * kDay).advice, Advice::kHolds);
  EXPECT_EQ(advice_by({check(0)}, kFirst + 15 * kDay), PublishedAdvice());
}

TEST(Advice, SaysToCheckAgainTwoWeeksBehindTheNewestOfMany) {
  std::vector<calib::CheckMeasurement> checks;
  for (int day = 0; day < 6; ++day) checks.push_back(check(day));
  EXPECT_EQ(advice_by(checks, kFirst + 6 * kDay).advice, Advice::kHolds);
  EXPECT_EQ(advice_by(checks, kFirst + 20 * kDay).advice, Advice::kCheckAgain);
}

TEST(Advice, SaysToCheckAgainBehindACheckThatDecidedNothing) {
  EXPECT_EQ(advice_by({check(0), check(1, true, calib::LeftOut::kUndecided)}, kFirst + kDay),
            (PublishedAdvice{Advice::kCheckAgain, 0}));
}

TEST(Advice, NamesWhatACheckThatDidNotHoldAsksFor) {
  EXPECT_EQ(advice_by({check(0), check(1, false)}, kFirst + kDay).advice, Advice::kReMeasureTcp);
  calib::CheckMeasurement sphere = check(1, false, calib::LeftOut::kNotTheTool);
  sphere.change->kind = calib::ChangeKind::kSphere;
  EXPECT_EQ(advice_by({check(0), sphere}, kFirst + kDay).advice, Advice::kRecalibrate);
  sphere.change->kind = calib::ChangeKind::kGrowth;
  EXPECT_EQ(advice_by({check(0), sphere}, kFirst + kDay).advice, Advice::kLetItWarmUp);
}

TEST(Advice, IsNotLoweredByACheckThatDecidedNothing) {
  const calib::CheckMeasurement undecided = check(2, true, calib::LeftOut::kUndecided);
  EXPECT_EQ(advice_by({check(0), check(1, false), undecided}, kFirst + 2 * kDay).advice,
            Advice::kReMeasureTcp);
}

TEST(Advice, IsUnknownByACheckDatedAfterToday) {
  EXPECT_EQ(advice_by({check(300)}, kFirst), PublishedAdvice());
}

TEST(Advice, DaysGrowOverTheEndsOfMonthsAndYears) {
  int before = day_number(kFirst - kDay);
  for (int day = 0; day < 800; ++day) {
    const int number = day_number(kFirst + day * kDay);
    EXPECT_GT(number, before) << day;
    before = number;
  }
}

}  // namespace
}  // namespace cellcal::daemon
