// Limits of the clock map: accepted samples, stated uncertainty, and treatment of round trips.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "drivers/contact/clock_map.h"
#include "tests/drivers/contact/rig.h"

namespace cellcal::drivers {
namespace {

constexpr double kEveryS = 0.25;
constexpr TimePoint kBegin{std::chrono::seconds(5000)};

TimePoint at(double s) { return kBegin + std::chrono::nanoseconds(std::llround(s * 1e9)); }
std::uint32_t ticks(double s) {
  return 77'000u + static_cast<std::uint32_t>(std::llround(s * CTP_TICKS_PER_S));
}

/// Sent at `s`; the sensor's stamps are `stamp_s` late, the answer is delayed by `held_s`.
ClockMap::Sample ping(ClockMap& map, double s, double stamp_s = 0.0, double held_s = 0.0) {
  constexpr double kTurnaroundS = 40e-6;
  const double rx = s + kWireS + stamp_s, tx = rx + kTurnaroundS;
  return map.add(at(s), at(s + 2 * kWireS + kTurnaroundS + held_s), ticks(rx), ticks(tx));
}
ClockMap map_of(
    int samples, const std::function<double(int)>& stamp_s = [](int) { return 0.0; }) {
  ClockMap map(kWireS);
  for (int i = 0; i < samples; ++i) {
    EXPECT_EQ(ping(map, kEveryS * i, stamp_s(i)), ClockMap::Sample::kTaken);
  }
  return map;
}
double error_us(const ClockMap& map, double s) {
  return 1e6 * std::chrono::duration<double>(map.to_host(ticks(s)) - at(s)).count();
}

TEST(ClockMapLimits, SaysNothingOfADriftThatItDoesNotKnow) {
  ClockMap map(kWireS);
  EXPECT_EQ(map.drift_ppm(), 0.0);
  EXPECT_EQ(map.samples(), 0u);
  EXPECT_EQ(map.round_trip_min_s(), 0.0);
}

TEST(ClockMapLimits, AnAnswerIsOlderThanItsQuestionByNoMoreThanTwoCrystalsDiffer) {
  const auto answered_in = [](double turnaround_s, double round_trip_s) {
    ClockMap map(kWireS);
    return map.add(at(0), at(round_trip_s), ticks(0), ticks(turnaround_s));
  };
  EXPECT_EQ(answered_in(0.10005, 0.1), ClockMap::Sample::kTaken);
  EXPECT_EQ(answered_in(0.10015, 0.1), ClockMap::Sample::kOutlier);
  // A PING is not delayed by a second.
  EXPECT_EQ(answered_in(0.99, 1.2), ClockMap::Sample::kTaken);
  EXPECT_EQ(answered_in(1.01, 1.2), ClockMap::Sample::kOutlier);
}

TEST(ClockMapLimits, WhatItsOwnRoundTripExplainsIsNoContradiction) {
  for (const double held_s : {0.010, 0.1}) {
    ClockMap map = map_of(20);
    EXPECT_EQ(ping(map, 5.0, 0.0, held_s), ClockMap::Sample::kTaken);
    EXPECT_NEAR(error_us(map, 5.0), 0.0, 0.1) << "and it moves nothing";
  }
  // Above it 2 ms are allowed for errors of the map.
  for (const double side : {1.0, -1.0}) {
    ClockMap map = map_of(20);
    EXPECT_EQ(ping(map, 5.0, side * 1.9e-3), ClockMap::Sample::kTaken);
    ClockMap other = map_of(20);
    EXPECT_EQ(ping(other, 5.0, side * 2.1e-3), ClockMap::Sample::kOutlier);
    EXPECT_EQ(other.samples(), 20u);
  }
}

TEST(ClockMapLimits, OnlyContradictionsInARowAreAJump) {
  ClockMap map = map_of(20);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(ping(map, 5.0 + i, 0.5), ClockMap::Sample::kOutlier);
    EXPECT_EQ(ping(map, 5.2 + i, 0.5), ClockMap::Sample::kOutlier);
    EXPECT_EQ(ping(map, 5.4 + i), ClockMap::Sample::kTaken);
  }
  EXPECT_EQ(ping(map, 10.0, 0.5), ClockMap::Sample::kOutlier);
  EXPECT_EQ(ping(map, 10.2, 0.5), ClockMap::Sample::kOutlier);
  EXPECT_EQ(ping(map, 10.4, 0.5), ClockMap::Sample::kJumped);
  EXPECT_EQ(map.samples(), 0u);
  EXPECT_FALSE(map.valid());
  // From there on it learns again, and counts contradictions from zero.
  for (int i = 0; i < 10; ++i) EXPECT_EQ(ping(map, 11.0 + i, 0.5), ClockMap::Sample::kTaken);
  EXPECT_TRUE(map.valid());
  EXPECT_EQ(ping(map, 22.0), ClockMap::Sample::kOutlier);
}

TEST(ClockMapLimits, AStampThatIsAFewMicrosecondsOffIsLeftOut) {
  const auto error_with = [](double off_s, double scatter_s) {
    ClockMap map = map_of(21, [=](int i) {
      return i == 10 ? off_s : i % 2 == 0 ? scatter_s : -scatter_s;
    });
    return error_us(map, 10 * kEveryS);
  };
  // Quiet: 4 us is the floor. One of 21 moves the map by a 21st.
  EXPECT_NEAR(error_with(5e-6, 0.0), 0.0, 0.05);
  EXPECT_NEAR(error_with(3.5e-6, 0.0), -3.5 / 21, 0.05);
  // Scatter of 2 us: four sigmas, as estimated from its median, are 11.9 us.
  EXPECT_NEAR(error_with(20e-6, 2e-6), 0.0, 0.15);
  EXPECT_LT(error_with(10e-6, 2e-6), -0.35);
}

TEST(ClockMapLimits, SaysHowSureItIsByTheNumberAndTheScatterOfItsSamples) {
  constexpr int kSamples = 40;
  double sxx = 0.0;
  const double middle = (kSamples - 1) / 2.0;
  for (int i = 0; i < kSamples; ++i) sxx += (i - middle) * (i - middle);
  const double to_newest = middle * middle / sxx;
  const ClockMap quiet = map_of(kSamples);
  const double one = 1.0 / kSamples;
  EXPECT_NEAR(1e6 * quiet.sigma_s(ticks(kEveryS * middle)), std::sqrt(1.0 + one), 0.002);
  EXPECT_NEAR(1e6 * quiet.sigma_s(), std::sqrt(1.0 + one + to_newest), 0.002);
  // Scatter of 3 us where 1 is expected: nine times the variance, and slightly more for the fit.
  const ClockMap loud = map_of(kSamples, [](int i) { return i % 4 < 2 ? 3e-6 : -3e-6; });
  const double scale = 9.0 * kSamples / (kSamples - 2);
  EXPECT_NEAR(1e6 * loud.sigma_s(ticks(kEveryS * middle)), std::sqrt(1.0 + scale * one), 0.01);
  EXPECT_NEAR(1e6 * loud.sigma_s(), std::sqrt(1.0 + scale * (one + to_newest)), 0.05);
}

TEST(ClockMapLimits, EachOfAFewSamplesCountsFromTheFirstToTheLast) {
  constexpr int kSamples = 8;
  double sxx = 0.0;
  const double middle = (kSamples - 1) / 2.0;
  for (int i = 0; i < kSamples; ++i) sxx += (i - middle) * (i - middle);
  const double one = 1.0 / kSamples, to_newest = middle * middle / sxx;
  const ClockMap quiet = map_of(kSamples);
  EXPECT_NEAR(1e6 * quiet.sigma_s(ticks(kEveryS * middle)), std::sqrt(1.0 + one), 0.002);
  EXPECT_NEAR(1e6 * quiet.sigma_s(), std::sqrt(1.0 + one + to_newest), 0.002);
  // Scatter of 3 us, evenly on both sides of the middle: all is scatter, six of eight are free.
  const ClockMap loud =
      map_of(kSamples, [](int i) { return i % 4 == 0 || i % 4 == 3 ? 3e-6 : -3e-6; });
  const double scale = 9.0 * kSamples / (kSamples - 2);
  EXPECT_NEAR(1e6 * loud.sigma_s(ticks(kEveryS * middle)), std::sqrt(1.0 + scale * one), 0.01);
}

TEST(ClockMapLimits, ThreeGoodSamplesAreEnoughForAMap) {
  // Three of eight samples have a long delay, two have stamps that are 30 us off.
  ClockMap map(kWireS);
  const double held_s[] = {0, 5e-3, 0, 0, 5e-3, 0, 5e-3, 0};
  const double stamp_s[] = {0, 0, 30e-6, -30e-6, 0, 0, 0, 0};
  for (int i = 0; i < 8; ++i) {
    EXPECT_EQ(ping(map, kEveryS * i, stamp_s[i], held_s[i]), ClockMap::Sample::kTaken);
  }
  ASSERT_TRUE(map.valid());
  EXPECT_NEAR(error_us(map, 2 * kEveryS), 0.0, 0.5);
}

TEST(ClockMapLimits, TheFirstSampleIsLeftOutAsAnyOther) {
  ClockMap map = map_of(21, [](int i) { return i == 0 ? 5e-6 : 0.0; });
  EXPECT_NEAR(error_us(map, 0.0), 0.0, 0.05);
}

TEST(ClockMapLimits, WhatAContradictionIsGrowsWithTheMapsOwnDoubt) {
  // Every answer is delayed by 10 ms: an uncertainty of 2.9 ms. Six of them and 2 ms are 19.3 ms.
  const auto taken = [](double stamp_s, double held_s) {
    ClockMap map(kWireS);
    for (int i = 0; i < 20; ++i) {
      EXPECT_EQ(ping(map, kEveryS * i, 0.0, 10e-3), ClockMap::Sample::kTaken) << i;
    }
    // The map is 5 ms off the stamps of an undelayed sample.
    return ping(map, 5.0, stamp_s, held_s) == ClockMap::Sample::kTaken;
  };
  EXPECT_TRUE(taken(13e-3, 0.0));
  EXPECT_FALSE(taken(16e-3, 0.0));
  EXPECT_TRUE(taken(-23e-3, 0.0));
  EXPECT_FALSE(taken(-26e-3, 0.0));
  EXPECT_TRUE(taken(0.0, 10e-3));
}

TEST(ClockMapLimits, AnExcessThatIsNeverMissingIsUniformOverItsHalf) {
  ClockMap map(kWireS);
  for (int i = 0; i < 40; ++i) ping(map, kEveryS * i, 0.0, 1e-3);
  EXPECT_NEAR(map.sigma_s(), 1e-3 / (2 * std::sqrt(3.0)), 1e-6);
  EXPECT_NEAR(error_us(map, 10.0), 500.0, 0.1);
}

TEST(ClockMapLimits, TheWindowIsTheNewest64) {
  ClockMap map(kWireS);
  // Errors of the first ten are forgotten 64 samples later.
  for (int i = 0; i < 10; ++i) ping(map, kEveryS * i, 0.0, 1e-3);
  for (int i = 10; i < 74; ++i) {
    ping(map, kEveryS * i, 0.0, 2e-3);
    EXPECT_EQ(map.round_trip_min_s() < 2e-3, i < 73) << i;
  }
  EXPECT_EQ(map.samples(), ClockMap::kWindow);
  EXPECT_NEAR(error_us(map, kEveryS * 74), 1000.0, 0.1);
}

TEST(ClockMapLimits, TellsTheLeastTheMiddleAndTheWorstRoundTrips) {
  ClockMap map(kWireS);
  const double own_s = 2 * kWireS + 40e-6;
  for (int i = 0; i < 64; ++i) ping(map, kEveryS * i, 0.0, 1e-6 * ((i * 37) % 64));
  EXPECT_NEAR(1e6 * (map.round_trip_min_s() - own_s), 0.0, 1e-3);
  EXPECT_NEAR(1e6 * (map.round_trip_p50_s() - own_s), 32.0, 1e-3);
  EXPECT_NEAR(1e6 * (map.round_trip_p99_s() - own_s), 62.0, 1e-3);
}

TEST(ClockMapLimits, HeldUpSamplesCountForLess) {
  // The answer of every other sample is delayed by 18 us: 9 us off, and 1/82 of the weight.
  ClockMap map(kWireS);
  for (int i = 0; i < 40; ++i) ping(map, kEveryS * i, 0.0, i % 2 == 0 ? 0.0 : 18e-6);
  EXPECT_NEAR(error_us(map, 5.0), 9.0 / 82 / (1 + 1.0 / 82), 0.02);
}

TEST(ClockMapLimits, FollowsADriftWhicheverSampleCameFirst) {
  for (const double ppm : {150.0, -150.0}) {
    ClockMap map(kWireS);
    for (int i = 0; i < 100; ++i) {
      const double s = kEveryS * i;
      const double rx = (s + kWireS) * (1 + ppm * 1e-6), tx = rx + 40e-6;
      map.add(at(s), at(s + 2 * kWireS + 40e-6), ticks(rx), ticks(tx));
    }
    EXPECT_NEAR(map.drift_ppm(), ppm, 0.05);
    const double later = 40.0;
    const double estimated =
        std::chrono::duration<double>(map.to_host(ticks(later * (1 + ppm * 1e-6))) - at(later))
            .count();
    EXPECT_NEAR(1e6 * estimated, 0.0, 2.0);
  }
}

}  // namespace
}  // namespace cellcal::drivers
