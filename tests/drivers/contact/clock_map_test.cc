// Ticks to host time: compared with a known clock, and through the whole stack.

#include "drivers/contact/clock_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "rig.h"

namespace cellcal::drivers {
namespace {

/// A sensor clock of known offset and drift, and a link with delays set by the test.
struct Truth {
  double drift_ppm = 0.0;
  std::uint32_t first = 0;

  std::uint32_t ticks(double host_s) const {
    const double n = host_s * CTP_TICKS_PER_S * (1.0 + drift_ppm * 1e-6);
    return first + static_cast<std::uint32_t>(static_cast<std::int64_t>(std::floor(n)));
  }
  static TimePoint host(double s) {
    return kStart + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(s));
  }
  ClockMap::Sample ping(ClockMap& map, double at_s, double out_s, double back_s) const {
    constexpr double kTurnaroundS = 40e-6;
    const double rx = at_s + kWireS + out_s;
    const double tx = rx + kTurnaroundS;
    return map.add(host(at_s), host(tx + kWireS + back_s), ticks(rx), ticks(tx));
  }
  double error_us(const ClockMap& map, double at_s) const {
    return micro(map.to_host(ticks(at_s)) - host(at_s));
  }
};

TEST(ClockMap, IsNotValidBeforeItHasEnoughSamples) {
  ClockMap map(kWireS);
  const Truth truth;
  for (std::size_t i = 0; i < ClockMap::kMinSamples; ++i) {
    EXPECT_FALSE(map.valid());
    truth.ping(map, 0.02 * static_cast<double>(i), 0, 0);
  }
  EXPECT_TRUE(map.valid());
}

TEST(ClockMap, FindsOffsetAndDriftOnAQuietLink) {
  for (const double ppm : {-200.0, -20.0, 0.0, 200.0, 5000.0}) {
    ClockMap map(kWireS);
    const Truth truth{ppm, 12345};
    for (int i = 0; i < 100; ++i) truth.ping(map, 0.25 * i, 0, 0);
    EXPECT_NEAR(map.drift_ppm(), ppm, 0.2);
    EXPECT_NEAR(truth.error_us(map, 25.0), 0.0, 1.0);
    EXPECT_LT(map.sigma_s(), 3e-6);
  }
}

TEST(ClockMap, CarriesTheWrapOfTheTicks) {
  ClockMap map(kWireS);
  const Truth truth{50.0, 0xFFFFFFFFu - 3u * CTP_TICKS_PER_S};
  for (int i = 0; i < 40; ++i) {
    truth.ping(map, 0.25 * i, 0, 0);
    if (map.valid()) {
      EXPECT_NEAR(truth.error_us(map, 0.25 * i + 0.1), 0.0, 10.0) << i;
    }
  }
}

TEST(ClockMap, RandomDelaysAreWithinTheStatedUncertainty) {
  int outside = 0, all = 0;
  for (unsigned seed = 0; seed < 50; ++seed) {
    std::mt19937 random(seed);
    std::exponential_distribution<double> delay(1.0 / 100e-6);  // either way, mean 100 us
    ClockMap map(kWireS);
    const Truth truth{static_cast<double>(seed) * 8.0 - 200.0, seed * 77'777u};
    for (int i = 0; i < 64; ++i) truth.ping(map, 0.25 * i, delay(random), delay(random));
    const double error_s = truth.error_us(map, 16.0) * 1e-6;
    const double sigma_s = map.sigma_s(truth.ticks(16.0));
    EXPECT_LT(sigma_s, 60e-6);
    outside += std::abs(error_s) > 2.0 * sigma_s ? 1 : 0;
    ++all;
  }
  EXPECT_LE(outside, all / 10) << "2 sigma should hold in about 95 % of the cases";
}

TEST(ClockMap, SamplesThatWereHeldUpDoNotShiftTheMap) {
  ClockMap map(kWireS);
  const Truth truth{100.0, 5};
  std::mt19937 random(3);
  for (int i = 0; i < 64; ++i) {
    const double held = random() % 3 == 0 ? 0.015 : 0.0;  // the adapter's timer, or load
    truth.ping(map, 0.25 * i, 2e-6, 2e-6 + held);
  }
  EXPECT_NEAR(truth.error_us(map, 16.0), 0.0, 5.0);
}

TEST(ClockMap, AConstantOneSidedDelayIsCoveredByTheUncertainty) {
  ClockMap map(kWireS);
  const Truth truth;
  constexpr double kHeldS = 4e-3;
  for (int i = 0; i < 64; ++i) truth.ping(map, 0.25 * i, 0, kHeldS);
  EXPECT_NEAR(truth.error_us(map, 16.0), kHeldS / 2 * 1e6, 5.0);
  EXPECT_GT(2.0 * map.sigma_s(), kHeldS / 2);
}

TEST(ClockMap, ASensorThatSendsFasterThanItsBaudRateIsCoveredByTheUncertainty) {
  for (const double faster_s : {5e-6, 32e-6}) {  // 115 200 baud from 16 MHz: 32 us in a PONG
    ClockMap map(kWireS);
    const Truth truth;
    for (int i = 0; i < 40; ++i) truth.ping(map, 0.25 * i, 0, -faster_s);
    ASSERT_TRUE(map.valid());
    EXPECT_LT(std::abs(truth.error_us(map, 10.0)) * 1e-6, 2.0 * map.sigma_s());
    EXPECT_LT(map.sigma_s(), faster_s);
  }
}

TEST(ClockMap, AnAnswerThatTookLongerThanTheRoundTripIsNoSample) {
  ClockMap map(kWireS);
  const TimePoint t = kStart;
  EXPECT_EQ(map.add(t, t + milliseconds{1}, 0, 4 * CTP_TICKS_PER_S / 1000),
            ClockMap::Sample::kOutlier);
  EXPECT_EQ(map.samples(), 0u);
}

TEST(ClockMap, ASingleContradictionIsAnOutlierThreeAreAJump) {
  ClockMap map(kWireS);
  const Truth truth{0.0, 1000};
  for (int i = 0; i < 20; ++i) truth.ping(map, 0.25 * i, 0, 0);
  const Truth restarted{0.0, 4'000'000};
  EXPECT_EQ(restarted.ping(map, 5.0, 0, 0), ClockMap::Sample::kOutlier);
  EXPECT_EQ(truth.ping(map, 5.25, 0, 0), ClockMap::Sample::kTaken);
  EXPECT_NEAR(truth.error_us(map, 5.3), 0.0, 2.0);
  EXPECT_EQ(restarted.ping(map, 5.5, 0, 0), ClockMap::Sample::kOutlier);
  EXPECT_EQ(restarted.ping(map, 5.75, 0, 0), ClockMap::Sample::kOutlier);
  EXPECT_EQ(restarted.ping(map, 6.0, 0, 0), ClockMap::Sample::kJumped);
  EXPECT_FALSE(map.valid());
}

TEST(ClockMap, SenselessSamplesAreNotTaken) {
  ClockMap map(kWireS);
  EXPECT_EQ(map.add(kStart, kStart - milliseconds{1}, 0, 10), ClockMap::Sample::kOutlier);
  EXPECT_EQ(map.add(kStart, kStart + milliseconds{1}, 10, 0), ClockMap::Sample::kOutlier);
  EXPECT_EQ(map.samples(), 0u);
}

TEST(ClockMap, UncertaintyGrowsAwayFromTheSamples) {
  ClockMap map(kWireS);
  const Truth truth;
  for (int i = 0; i < 10; ++i) truth.ping(map, 0.02 * i, 0, 0);
  EXPECT_GT(map.sigma_s(truth.ticks(100.0)), 10.0 * map.sigma_s(truth.ticks(0.2)));
}

class ClockThroughTheStack : public testing::TestWithParam<std::tuple<double, std::uint32_t>> {};

TEST_P(ClockThroughTheStack, TouchTimesAreRightToAFewMicroseconds) {
  sim::McuOptions mcu;
  mcu.drift_ppm = std::get<0>(GetParam());
  mcu.first_ticks = std::get<1>(GetParam());
  Rig rig(mcu);
  ASSERT_TRUE(rig.get_ready());
  for (std::uint16_t id = 1; id <= 10; ++id) {
    rig.run(milliseconds{700});
    ASSERT_TRUE(rig.arm(id).armed);
    const TimePoint touch = rig.now() + microseconds{1234 + 77 * id};
    rig.mcu.edge(touch, true);
    rig.run(milliseconds{20});
    rig.mcu.edge(rig.now(), false);
    rig.run(milliseconds{20});
    const auto contacts = rig.of_kind(ContactEventKind::kContact);
    ASSERT_EQ(contacts.size(), id);
    EXPECT_NEAR(micro(contacts.back().first_edge - touch), 0.0, 3.0);
    EXPECT_LT(contacts.back().time_sigma_s, 10e-6);
  }
  EXPECT_NEAR(rig.contact.status().quality.clock_drift_ppm.value(), mcu.drift_ppm, 1.0);
}

INSTANTIATE_TEST_SUITE_P(DriftAndWrap, ClockThroughTheStack,
                         testing::Combine(testing::Values(-200.0, 0.0, 200.0),
                                          testing::Values(0u, 0xFFFFFFFFu - 2u * CTP_TICKS_PER_S,
                                                          0x7FFFFFFFu - 2u * CTP_TICKS_PER_S)));

}  // namespace
}  // namespace cellcal::drivers
