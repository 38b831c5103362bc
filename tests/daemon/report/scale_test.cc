#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "daemon/report/axes.h"

namespace cellcal::daemon::report {
namespace {

TEST(Scale, MapsEndsOntoEnds) {
  const Scale scale{-3.0, 3.0, 100.0, 20.0};
  EXPECT_DOUBLE_EQ(scale(-3.0), 100.0);
  EXPECT_DOUBLE_EQ(scale(3.0), 20.0);
  EXPECT_DOUBLE_EQ(scale(0.0), 60.0);
}

TEST(Scale, BringsWhatIsOutsideToTheEdge) {
  const Scale scale{-3.0, 3.0, 100.0, 20.0};
  EXPECT_DOUBLE_EQ(scale.clamped(17.0), 20.0);
  EXPECT_TRUE(scale.holds(-3.0));
  EXPECT_FALSE(scale.holds(3.1));
}

TEST(RoundTicks, AreMultiplesOfOneTwoOrFive) {
  EXPECT_EQ(round_ticks(-4.0, 4.0, 5), (std::vector<double>{-4.0, -2.0, 0.0, 2.0, 4.0}));
  EXPECT_EQ(round_ticks(0.0, 1.0, 5).size(), 6U);
  const auto fine = round_ticks(-0.03, 0.03, 6);
  ASSERT_EQ(fine.size(), 7U);
  EXPECT_NEAR(fine[4], 0.01, 1e-12);
}

TEST(RoundTicks, HitZeroExactlySoThatTheZeroLineIsFound) {
  for (const double range : {0.07, 0.3, 1.7, 44.0, 1300.0}) {
    const auto ticks = round_ticks(-range, range, 5);
    EXPECT_EQ(std::count(ticks.begin(), ticks.end(), 0.0), 1) << range;
  }
}

TEST(RoundTicks, AreNeverMoreThanTwiceWhatWasWanted) {
  for (double range = 1e-6; range < 1e6; range *= 1.37) {
    for (int wanted = 2; wanted < 12; ++wanted) {
      const auto ticks = round_ticks(-0.3 * range, 0.7 * range, wanted);
      EXPECT_GE(ticks.size(), 1U);
      EXPECT_LE(ticks.size(), static_cast<std::size_t>(2 * wanted) + 1) << range << " " << wanted;
    }
  }
}

TEST(RoundTicks, AreEmptyForRangesThatCannotBeDivided) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double most = std::numeric_limits<double>::max();
  EXPECT_TRUE(round_ticks(1.0, 1.0, 5).empty());
  EXPECT_TRUE(round_ticks(2.0, 1.0, 5).empty());
  EXPECT_TRUE(round_ticks(nan, 1.0, 5).empty());
  EXPECT_TRUE(round_ticks(0.0, nan, 5).empty());
  EXPECT_TRUE(round_ticks(-most, most, 5).empty());
  EXPECT_TRUE(round_ticks(0.0, 1.0, 0).empty());
  EXPECT_TRUE(round_ticks(1e12, 1e12 + 1e-4, 5).empty());
}

TEST(TickLabels, HaveTheDecimalsThatTheStepNeeds) {
  EXPECT_EQ(tick_labels(round_ticks(0.0, 0.1, 4)).at(1), "0.05");
  EXPECT_EQ(tick_labels(round_ticks(0.0, 1000.0, 5)).at(1), "200");
  EXPECT_TRUE(tick_labels({}).empty());
}

TEST(RoundUp, NeverLosesTheValue) {
  for (double value = 1e-5; value < 1e5; value *= 1.07) {
    const double limit = round_up(value, 1.0);
    EXPECT_GE(limit, value * (1.0 - 1e-8));
    EXPECT_LE(limit, value * 1.6);
  }
}

TEST(RoundUp, FallsBackWhereThereIsNoRange) {
  EXPECT_EQ(round_up(0.0, 0.1), 0.1);
  EXPECT_EQ(round_up(std::numeric_limits<double>::quiet_NaN(), 0.1), 0.1);
  EXPECT_EQ(round_up(std::numeric_limits<double>::infinity(), 0.1), 0.1);
}

}  // namespace
}  // namespace cellcal::daemon::report
