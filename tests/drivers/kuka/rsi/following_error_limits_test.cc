// Exact thresholds of the following-error monitor, on synthetic records.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "drivers/kuka/rsi/rsi_stops.h"
#include "drivers/units.h"
#include "tests/drivers/kuka/expect_cause.h"

namespace cellcal::drivers {
namespace {

constexpr int kRestBefore = 200;

struct NamedAtSample {
  int sample = -1;  ///< after the command began to change
  Cause fault;
};

/// Both axes' angles [deg] by sample; the first is constant, the second is commanded and moves as
/// given.
NamedAtSample watch(const std::function<double(int)>& commanded,
                    const std::function<double(int)>& actual, double cycle_s = 0.004,
                    int samples = 200, const RsiConfig& config = {}) {
  PositionRecord record;
  for (int i = -kRestBefore; i < samples; ++i) {
    const auto t = std::chrono::microseconds(std::llround(1e6 * cycle_s * (i + kRestBefore)));
    record.push(TimePoint{} + t, 0, {0.0, actual(i) * kRadPerDeg},
                {0.0, commanded(i) * kRadPerDeg});
    if (const auto fault = following_fault(record, config, cycle_s)) return {i, *fault};
  }
  return {};
}

double stands(int) { return 0.0; }
/// At a constant speed from sample 0 on.
std::function<double(int)> goes(double deg_s, double cycle_s = 0.004) {
  return [=](int i) { return i < 0 ? 0.0 : deg_s * cycle_s * i; };
}

TEST(FollowLimits, WhatWasCommandedWithinTheWindowMayStillBeWhereTheArmIs) {
  // A step of a degree at sample 0, of which the arm follows half: from sample 50 on commands
  // before it are older than 0.2 s.
  const auto step = [](double deg) { return [=](int i) { return i < 0 ? 0.0 : deg; }; };
  const NamedAtSample named = watch(step(1.0), step(0.5));
  EXPECT_EQ(named.sample, 50);
  expect_cause(named.fault, cause::AxisNotFollowing{1, 1.0, 0.5});
}

TEST(FollowLimits, TheToleranceHoldsToEitherSide) {
  for (const double side : {1.0, -1.0}) {
    const auto off_by = [&](double deg) {
      return watch(stands, [&](int i) { return i < 10 ? 0.0 : side * deg; });
    };
    EXPECT_EQ(off_by(0.049).sample, -1);
    const NamedAtSample named = off_by(0.051);
    EXPECT_EQ(named.sample, 10);
    expect_cause(named.fault, cause::AxisNotFollowing{1, 0.0, side * 0.051});
  }
}

TEST(FollowLimits, AnAxisThatDoesLessThanAQuarterOfItsCommandStands) {
  for (const double speed_deg_s : {0.12, -0.12}) {
    const NamedAtSample slow = watch(goes(speed_deg_s), goes(0.2 * speed_deg_s), 0.004, 100);
    const double commanded_deg = speed_deg_s * 0.004 * slow.sample;
    expect_cause(slow.fault, cause::AxisStands{1, commanded_deg, 0.2 * commanded_deg});
    EXPECT_EQ(watch(goes(speed_deg_s), goes(0.3 * speed_deg_s), 0.004, 100).sample, -1);
    EXPECT_NE(watch(goes(speed_deg_s), goes(-speed_deg_s), 0.004, 100).sample, -1);
  }
}

// The command must have travelled 0.006 deg in every window that ends up to the lag ago (0.12 s) or
// within the reach of the means: 30 + 3 samples, and then as many as 0.006 deg take.
TEST(FollowLimits, StandingIsNamedAsSoonAsTheCommandIsToldFromNoise) {
  EXPECT_EQ(watch(goes(0.12), stands).sample, 33 + 13);  // 13 * 0.00048 deg
  EXPECT_EQ(watch(goes(0.55), stands).sample, 33 + 3);
  // Too slow for the window of 0.06 s (15 samples): the one of 0.12, whose means are 7 long.
  EXPECT_EQ(watch(goes(0.076), stands).sample, 30 + 7 + 20);
  // And that of 0.24, 15 long; nothing is reported below 0.006 deg in it.
  EXPECT_EQ(watch(goes(0.038), stands).sample, 30 + 15 + 40);
  EXPECT_EQ(watch(goes(0.024), stands, 0.004, 400).sample, -1);
}

TEST(FollowLimits, FewPacketsInAMeanAskForMoreTravel) {
  // At 12 ms a window of 0.06 s is 5 packets and its means one: sqrt(3) of travel more.
  const double cycle_s = 0.012;
  EXPECT_EQ(watch(goes(0.3, cycle_s), stands, cycle_s).sample, 10 + 1 + 3);  // 0.0036 deg each
}

TEST(FollowLimits, ARecordThatIsTooShortSaysNothing) {
  PositionRecord record;
  int named = -1;
  for (int i = 0; i < 100 && named < 0; ++i) {
    record.push(TimePoint{} + std::chrono::milliseconds(4 * i), 0, {0.0},
                {0.00045 * i * kRadPerDeg});
    if (following_fault(record, {}, 0.004)) named = i;
  }
  // Window 15, lag 30, means of 3: the record holds one more than these.
  EXPECT_EQ(named, 15 + 30 + 3);
}

// As above: at 0.12 deg/s an arm at standstill is reported with sample 46, and not before.
TEST(FollowLimits, WhatTheNewestPacketShowsCounts) {
  const auto ahead = goes(0.12);
  const auto up_to = [](const std::function<double(int)>& commanded,
                        const std::function<double(int)>& actual) {
    return watch(commanded, actual, 0.004, 47).sample;
  };
  ASSERT_EQ(up_to(ahead, stands), 46);
  EXPECT_EQ(up_to(ahead, [](int i) { return i < 46 ? 0.0 : 0.02; }), -1) << "it has begun to move";
  const auto turned_in = [&](int sample) {
    return [=](int i) { return i == sample ? ahead(i - 15) : ahead(i); };
  };
  EXPECT_EQ(up_to(turned_in(46), stands), -1) << "now its command does not go on";
  EXPECT_EQ(up_to(turned_in(45), stands), -1) << "nor did it a packet ago";
}

TEST(FollowLimits, ACommandThatTurnsRoundIsNotHeldAgainstTheArm) {
  const auto to_and_fro = [](int i) {
    const int phase = ((i % 20) + 20) % 20;
    return i < 0 ? 0.0 : 0.001 * (phase < 10 ? phase : 20 - phase);
  };
  EXPECT_EQ(watch(to_and_fro, stands, 0.004, 300).sample, -1);
}

}  // namespace
}  // namespace cellcal::drivers
