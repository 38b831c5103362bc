// Properties of the link derived from packets: consecutive ones, old ones, those of another session;
// learning of the cycle, and the number of packets needed.

#include "drivers/kuka/rsi/rsi_stream.h"

#include <gtest/gtest.h>

#include <cmath>

namespace cellcal::drivers {
namespace {

using namespace std::chrono_literals;

struct Stream : testing::Test {
  Arrival push(std::int64_t ipoc, double after_s = 0.004) {
    now += std::chrono::nanoseconds(std::llround(1e9 * after_s));
    frame.ipoc.value = static_cast<std::uint32_t>(newest = ipoc);
    return stream.push(frame, now);
  }
  /// This many further packets, uniformly.
  void go(int packets, int step, double cycle_s) {
    for (int i = 0; i < packets; ++i) ASSERT_EQ(push(newest + step, cycle_s), Arrival::kNext) << i;
  }
  void begin(int packets, int step, double cycle_s) {
    ASSERT_EQ(push(10'000), Arrival::kFirst);
    go(packets, step, cycle_s);
  }

  RsiStream stream{3};
  RobFrame frame;
  TimePoint now{1000s};
  std::int64_t newest = 0;
};

TEST_F(Stream, KnowsNothingBeforeItsFirstPackets) {
  EXPECT_EQ(stream.seconds_per_ipoc(), 0.0);
  EXPECT_EQ(stream.cycle_s(), 0.0);
  EXPECT_EQ(stream.step(), 0u);
  EXPECT_EQ(push(0), Arrival::kFirst);
  EXPECT_EQ(push(0), Arrival::kRepeat);
  EXPECT_EQ(push(4), Arrival::kNext);
  EXPECT_EQ(push(4), Arrival::kRepeat);
  EXPECT_EQ(stream.step(), 4u);
  EXPECT_EQ(stream.packets(), 2u);
}

TEST_F(Stream, MotionIsNeverComputedForMoreThanIpocsMilliseconds) {
  // Received late for a while: the pace seems to be 5 ms.
  begin(40, 4, 0.005);
  EXPECT_NEAR(stream.cycle_s(), 0.005, 1e-9);
  EXPECT_NEAR(stream.motion_cycle_s(), 0.004, 1e-12);
  stream.reset();
  begin(40, 4, 0.003);
  EXPECT_NEAR(stream.motion_cycle_s(), 0.003, 1e-9) << "a shorter one is the slower motion";
  stream.reset();
  begin(40, 1, 0.005);  // packets are counted
  EXPECT_NEAR(stream.motion_cycle_s(), 0.005, 1e-9);
}

TEST_F(Stream, TheFirstStepMayBeAHundredAndNoMore) {
  push(0);
  EXPECT_EQ(push(100), Arrival::kNext);
  stream.reset();
  push(0);
  EXPECT_EQ(push(101), Arrival::kRestart);
}

// Three cycles of silence are allowed here: four steps of IPOC at once are lost packets.
TEST_F(Stream, PacketsWithinTheSilenceAreLateOrLostAndOthersAnotherSessions) {
  for (const int step : {1, 4, 12}) {
    stream.reset();
    begin(5, step, 0.001 * step);
    const std::int64_t here = newest;
    EXPECT_EQ(push(here - 4 * step), Arrival::kStale) << step;
    EXPECT_EQ(push(here - step), Arrival::kStale);
    EXPECT_EQ(push(here - 4 * step - 1), Arrival::kRestart) << step;
    EXPECT_EQ(push(here - 100'000), Arrival::kRestart);
    EXPECT_EQ(push(here + 4 * step + 1), Arrival::kRestart) << step;
    EXPECT_EQ(push(here + 100'000), Arrival::kRestart);
    EXPECT_EQ(stream.gaps(), 0u) << "none of them was taken";
    EXPECT_EQ(push(here + 4 * step), Arrival::kNext) << step;
    EXPECT_EQ(stream.gaps(), 3u);
  }
}

TEST_F(Stream, DelayThatCountsBackIsAnotherSessionAndOneThatBeginsToBeSentIsNot) {
  begin(3, 4, 0.004);
  frame.delay = 0;
  EXPECT_EQ(push(newest + 4), Arrival::kNext);
  frame.delay = 2;
  EXPECT_EQ(push(newest + 4), Arrival::kNext);
  frame.delay = 1;
  EXPECT_EQ(push(newest + 4), Arrival::kRestart);
}

// ---- the cycle --------------------------------------------------------------------------------------

TEST_F(Stream, LearnsFromTwentyFiveIntervals) {
  begin(24, 4, 0.004);
  EXPECT_FALSE(stream.learnt());
  go(1, 4, 0.004);
  EXPECT_TRUE(stream.learnt());
  EXPECT_EQ(stream.cycle_s(), 0.004);
  EXPECT_EQ(stream.seconds_per_ipoc(), 0.001);
}

TEST_F(Stream, TakesIpocForMillisecondsWithinFifteenPercentOfThem) {
  const auto learn = [&](int step, double cycle_s) {
    stream.reset();
    begin(25, step, cycle_s);
  };
  learn(4, 0.00455);
  EXPECT_EQ(stream.cycle_s(), 0.004);
  learn(4, 0.0047);
  EXPECT_NEAR(stream.cycle_s(), 0.0047, 1e-9) << "a stall, until it is seen to be one";
  EXPECT_TRUE(stream.counts_milliseconds()) << "four and more is a controller's";
  learn(2, 0.0022);
  EXPECT_TRUE(stream.counts_milliseconds());
  EXPECT_EQ(stream.cycle_s(), 0.002);
  learn(2, 0.0025);
  EXPECT_TRUE(stream.counts_packets());
  EXPECT_NEAR(stream.cycle_s(), 0.0025, 1e-9);
}

TEST_F(Stream, APauseCountsAsTwiceTheMiddleInterval) {
  push(10'000);
  for (int i = 0; i < 25; ++i) push(newest + 1, i == 7 ? 0.1 : 0.010);
  EXPECT_NEAR(stream.cycle_s(), (24 * 0.010 + 0.020) / 25, 1e-9);
  // The median, not one of the shorter third.
  stream.reset();
  push(10'000);
  for (int i = 0; i < 25; ++i) push(newest + 1, i % 5 < 2 ? 0.004 : 0.012);
  EXPECT_NEAR(stream.cycle_s(), (10 * 0.004 + 15 * 0.012) / 25, 1e-9);
}

TEST_F(Stream, AnOddCycleIsForgottenWholly) {
  begin(25, 1, 0.060);
  EXPECT_TRUE(stream.odd_cycle());
  EXPECT_FALSE(stream.learnt());
  go(24, 1, 0.010);
  EXPECT_FALSE(stream.learnt());
  go(1, 1, 0.010);
  EXPECT_TRUE(stream.learnt());
  EXPECT_FALSE(stream.odd_cycle());
  EXPECT_NEAR(stream.cycle_s(), 0.010, 1e-9);
}

TEST_F(Stream, TwoCyclesThatWereTakenForOneAreOneAgainWithTheFirstShortStep) {
  begin(25, 8, 0.008);
  EXPECT_EQ(stream.cycle_s(), 0.008);
  go(1, 4, 0.004);
  EXPECT_EQ(stream.step(), 4u);
  EXPECT_EQ(stream.cycle_s(), 0.004);
}

TEST_F(Stream, OfAControllerThatWasLearntFromLateArrivalsIsItsOwnOnceTheyAreInTime) {
  begin(25, 4, 0.006);
  EXPECT_NEAR(stream.cycle_s(), 0.006, 1e-9);
  go(1, 4, 0.006);
  EXPECT_NEAR(stream.cycle_s(), 0.006, 1e-9) << "not yet";
  go(40, 4, 0.004);
  EXPECT_EQ(stream.cycle_s(), 0.004);
  go(40, 4, 0.006);
  EXPECT_EQ(stream.cycle_s(), 0.004) << "and stays it";
}

TEST_F(Stream, OfOneThatCountsPacketsFollowsItsPaceAlsoPastMilliseconds) {
  begin(25, 2, 0.0025);
  ASSERT_TRUE(stream.counts_packets());
  go(100, 2, 0.002);
  EXPECT_NEAR(stream.cycle_s(), 0.002, 1e-9);
  go(1, 2, 0.0024);
  go(100, 2, 0.0024);
  EXPECT_NEAR(stream.cycle_s(), 0.0024, 1e-9);
  EXPECT_TRUE(stream.counts_packets());
}

}  // namespace
}  // namespace cellcal::drivers
