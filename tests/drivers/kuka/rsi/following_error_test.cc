// The following-error monitor by itself: synthetic arms, with pure dead time.

#include <gtest/gtest.h>

#include <random>

#include "drivers/kuka/rsi/path_move.h"
#include "drivers/kuka/rsi/rsi_stops.h"
#include "drivers/units.h"

namespace cellcal::drivers {
namespace {

struct Arm {
  double dead_time_s = 0.02, lag_s = 0.0, cycle_s = 0.004, noise_deg = 0.0005;
  double resolution_deg = 0.0001;
  std::optional<double> stands_at_s;  ///< after the start of the move
  unsigned seed = 7;
};

/// One move of A1 by `travel_deg` in `cruise_s`; time and kind of the report.
struct Named {
  double at_s = 0.0;
  Cause fault;
};
std::optional<Named> watch(const Arm& arm, double travel_deg, double cruise_s) {
  RsiConfig config;
  const AxisLimit limit{-9, 9, 100 * kRadPerDeg, 400 * kRadPerDeg, 4000 * kRadPerDeg};
  config.limits = {limit};
  const PathMove line({0.0}, {travel_deg * kRadPerDeg}, config.limits, cruise_s);
  PositionRecord record;
  std::mt19937 random(arm.seed);
  std::normal_distribution<double> noise(0.0, arm.noise_deg);
  double position = 0.0;
  constexpr double kRestBefore = 0.4;
  for (double t = -kRestBefore; t < line.duration_s() + 0.5; t += arm.cycle_s) {
    const double commanded = line.at(std::max(0.0, t))[0];
    const double due = line.at(std::max(0.0, t - arm.dead_time_s))[0];
    const double share = arm.lag_s > 0.0 ? -std::expm1(-arm.cycle_s / arm.lag_s) : 1.0;
    if (!arm.stands_at_s || t < *arm.stands_at_s) position += share * (due - position);
    const double seen_deg =
        std::round((position / kRadPerDeg + noise(random)) / arm.resolution_deg) *
        arm.resolution_deg;
    record.push(TimePoint{} + std::chrono::microseconds(std::llround(1e6 * (t + 1.0))), 0,
                {seen_deg * kRadPerDeg}, {commanded});
    if (t >= line.duration_s()) break;  // monitored while the command advances
    if (const auto fault = following_fault(record, config, arm.cycle_s)) return Named{t, *fault};
  }
  return std::nullopt;
}

TEST(FollowingError, AnArmThatLagsIsNeverTakenForOneThatStands) {
  for (const double cycle_s : {0.002, 0.004, 0.012, 0.04}) {
    for (const double dead_time_s : {0.0, 0.01, 0.04, 0.08, 0.12}) {
      for (const double lag_s : {0.0, 0.02, 0.04}) {
        if (dead_time_s + 3 * lag_s > 0.121) continue;  // slower than longest_lag_s
        for (const double resolution_deg : {0.0001, 0.001}) {
          const Arm arm{dead_time_s, lag_s, cycle_s, 0.0005, resolution_deg, {}};
          for (const auto& [travel_deg, cruise_s] :
               {std::pair{0.5, 10.0}, {2.0, 10.0}, {-2.0, 1.0}, {8.0, 0.0}, {-90.0, 0.0}}) {
            EXPECT_FALSE(watch(arm, travel_deg, cruise_s))
                << cycle_s << " " << dead_time_s << " " << lag_s << " " << travel_deg;
          }
        }
      }
    }
  }
}

TEST(FollowingError, NoiseOfManySlowSearchesAccusesNoArm) {
  // Speeds at which the command is just sufficient for one of the windows.
  for (const auto& [cycle_s, speed_deg_s] :
       {std::pair{0.004, 0.068}, {0.012, 0.068}, {0.012, 0.075}, {0.04, 0.018}, {0.04, 0.035}}) {
    const unsigned searches = cycle_s < 0.01 ? 200 : 1500;
    for (unsigned seed = 1; seed <= searches; ++seed) {
      Arm arm{0.04, 0.0, cycle_s, 0.0005, 0.0001, {}};
      arm.seed = seed;
      EXPECT_FALSE(watch(arm, 10.0 * speed_deg_s, 10.0))
          << cycle_s << " s, " << speed_deg_s << " deg/s, " << seed;
    }
  }
}

TEST(FollowingError, AnArmThatComesToStandIsNamedWithinATenthOfASecond) {
  for (const double cycle_s : {0.004, 0.012}) {
    for (const double dead_time_s : {0.01, 0.04, 0.12}) {
      for (const auto& [travel_deg, cruise_s] :
           {std::pair{2.0, 10.0}, {-2.0, 1.0}, {20.0, 2.0}, {-90.0, 0.0}}) {
        Arm arm{dead_time_s, 0.0, cycle_s, 0.0005, 0.0001, {}};
        arm.stands_at_s = 0.5;
        const auto named = watch(arm, travel_deg, cruise_s);
        ASSERT_TRUE(named) << travel_deg;
        EXPECT_GE(named->at_s, *arm.stands_at_s) << "not before it stands";
        EXPECT_LE(named->at_s, *arm.stands_at_s + 0.1) << dead_time_s << " " << travel_deg;
      }
    }
  }
}

TEST(FollowingError, AnAxisTooSlowForAShortLookIsNamedAfterALongerOne) {
  Arm arm;
  arm.stands_at_s = 1.0;
  const auto named = watch(arm, 0.5, 15.0);  // 0.033 deg/s
  ASSERT_TRUE(named);
  EXPECT_TRUE(is<cause::AxisStands>(named->fault));
  EXPECT_LE(named->at_s, 1.3);
}

TEST(FollowingError, AnArmThatNeverMovesIsNamedOnceItsLagIsOver) {
  Arm arm;
  arm.stands_at_s = -1.0;
  const auto named = watch(arm, 2.0, 10.0);  // 0.2 deg/s
  ASSERT_TRUE(named);
  const auto* stands = std::get_if<cause::AxisStands>(&named->fault);
  ASSERT_NE(stands, nullptr);
  EXPECT_LE(named->at_s, 0.12 + 0.12);
  EXPECT_NEAR(stands->actual_deg, 0.0, 0.002);
  EXPECT_GT(stands->commanded_deg, 0.02);
}

TEST(FollowingError, AnAxisThatGoesElsewhereIsNamedByItsDistance) {
  RsiConfig config;
  config.limits.assign(2, {-9, 9, 1, 1, 1});
  PositionRecord record;
  for (int i = 0; i < 100; ++i) {
    const double drift = i < 50 ? 0.0 : 0.002 * (i - 50) * kRadPerDeg;
    record.push(TimePoint{} + std::chrono::milliseconds(4 * i), 0, {0.0, drift}, {0.0, 0.0});
    const auto fault = following_fault(record, config, 0.004);
    ASSERT_EQ(fault.has_value(), i > 75) << i;
    if (!fault) continue;
    const auto* astray = std::get_if<cause::AxisNotFollowing>(&*fault);
    ASSERT_NE(astray, nullptr);
    EXPECT_EQ(astray->axis, 1);
    break;
  }
}

}  // namespace
}  // namespace cellcal::drivers
