// The correction held by a controller, from each kind of evidence alone and at its limits;
// evaluation of Delay; and the reply that leads to a desired correction.

#include <gtest/gtest.h>

#include <cmath>

#include "drivers/kuka/rsi/rsi_setpoint.h"
#include "drivers/kuka/rsi/rsi_stream.h"
#include "drivers/units.h"

namespace cellcal::drivers {
namespace {

using namespace std::chrono_literals;
constexpr TimePoint kThen{1000s};

AxisAngles deg(double a1, double a2) { return {a1 * kRadPerDeg, a2 * kRadPerDeg}; }

void expect_known(OffsetFinder& finder, const OffsetEvidence& evidence, const AxisAngles& offset) {
  ASSERT_EQ(finder.update(evidence), OffsetVerdict::kKnown);
  ASSERT_EQ(finder.offset_rad().size(), offset.size());
  for (std::size_t i = 0; i < offset.size(); ++i) {
    EXPECT_NEAR(finder.offset_rad()[i], offset[i], 1e-12);
  }
}

// ---- by ASPos
// --------------------------------------------------------------------------------------

OffsetEvidence measured(double a1_deg, double a2_deg = 0.0) {
  OffsetEvidence evidence;
  evidence.t_rx = kThen;
  evidence.setpoint_rad = deg(10, -20);
  evidence.actual_rad = deg(10 + a1_deg, -20 + a2_deg);
  return evidence;
}
OffsetMemory sent(double a1_deg, double a2_deg = 0.0) {
  OffsetMemory memory;
  memory.known = true;
  memory.sent_rad = deg(a1_deg, a2_deg);
  return memory;
}

TEST(OffsetBySetpoint, WhatWasSentIsHeldWhereTheDifferenceSaysSo) {
  OffsetFinder finder;
  finder.begin(sent(5, -3));
  expect_known(finder, measured(5.019, -3.0), deg(5, -3));
  finder.begin(sent(5, -3));
  EXPECT_EQ(finder.update(measured(5.021, -3.0)), OffsetVerdict::kWaitForRest);
}

TEST(OffsetBySetpoint, AFreshSessionHoldsNone) {
  OffsetFinder finder;
  finder.begin({});
  expect_known(finder, measured(0.019, -0.019), deg(0, 0));
  finder.begin({});
  EXPECT_EQ(finder.update(measured(0.021)), OffsetVerdict::kWaitForRest);
  // Also if almost none was sent; but not closer to the values sent.
  finder.begin(sent(-0.015));
  expect_known(finder, measured(0.010), deg(0, 0));
  finder.begin(sent(0.015));
  expect_known(finder, measured(0.010), deg(0.015, 0));
}

TEST(OffsetBySetpoint, AfterACorrectionItIsBelievedThatThereIsNoneOnlyAtRestBehindASilence) {
  OffsetFinder finder;
  finder.begin(sent(5));
  OffsetEvidence none = measured(0.01);
  none.silence_before_s = 0.2;
  for (int i = 0; i < 3; ++i) EXPECT_EQ(finder.update(none), OffsetVerdict::kWaitForRest) << i;
  expect_known(finder, none, deg(0, 0));
  none.silence_before_s = 0.19;  // no program restarts within it
  EXPECT_EQ(finder.update(none), OffsetVerdict::kDenied);
}

TEST(OffsetBySetpoint, WhatIsNeitherSentNorNoneIsLeftUnanswered) {
  for (const auto& [at_deg, verdict] : {std::pair{4.951, OffsetVerdict::kKnown},
                                        {4.949, OffsetVerdict::kDenied},
                                        {4.0, OffsetVerdict::kDenied},
                                        {-1.0, OffsetVerdict::kDenied}}) {
    OffsetFinder finder;
    finder.begin(sent(5));
    OffsetEvidence evidence = measured(at_deg);
    evidence.silence_before_s = 10.0;
    for (int i = 0; i < 3; ++i) finder.update(evidence);
    ASSERT_EQ(finder.update(evidence), verdict) << at_deg;
    if (verdict == OffsetVerdict::kKnown) {
      EXPECT_EQ(finder.offset_rad(), deg(5, 0));
    }
  }
  OffsetFinder before_any;
  before_any.begin({});
  for (int i = 0; i < 3; ++i) before_any.update(measured(4.0));
  expect_known(before_any, measured(4.0), deg(4, 0));
}

TEST(OffsetBySetpoint, RestIsThreePacketsInARowWithoutFiveThousandthsOfADegree) {
  OffsetFinder finder;
  finder.begin(sent(5));
  double at = 2.0;
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(finder.update(measured(at += 0.0051)), OffsetVerdict::kWaitForRest);
  }
  for (int i = 0; i < 2; ++i) EXPECT_EQ(finder.update(measured(at)), OffsetVerdict::kWaitForRest);
  EXPECT_EQ(finder.update(measured(at += 1.0)), OffsetVerdict::kWaitForRest)
      << "from the beginning";
  for (int i = 0; i < 2; ++i)
    EXPECT_EQ(finder.update(measured(at += 0.0049)), OffsetVerdict::kWaitForRest);
  EXPECT_EQ(finder.update(measured(at)), OffsetVerdict::kDenied)
      << "at rest, and not what was sent";
  // Another start discards it.
  finder.begin(sent(5));
  EXPECT_EQ(finder.update(measured(at)), OffsetVerdict::kWaitForRest);
}

TEST(OffsetBySetpoint, AnArmThatStillComesToRestIsNotTakenForOneAtAnEarlierReply) {
  // A search of 1.3 deg/s at cycles of 4 ms, frozen: the arm comes to rest with 20 ms.
  OffsetMemory memory = sent(5);
  for (const double earlier_deg : {4.9840, 4.9893, 4.9946, 5.0})
    memory.earlier_rad.push_back(deg(earlier_deg, 0));
  OffsetFinder finder;
  finder.begin(memory);
  for (int i = 0; i < 100; ++i) {
    if (finder.update(measured(5.0 - 0.026 * std::exp(-0.2 * i))) == OffsetVerdict::kWaitForRest)
      continue;
    EXPECT_EQ(finder.offset_rad(), deg(5, 0)) << "at packet " << i;
    return;
  }
  FAIL() << "waits for ever";
}

TEST(OffsetBySetpoint, APeerThatWaitsForAnAnswerRests) {
  OffsetFinder finder;
  finder.begin({});
  OffsetEvidence waits = measured(2.0);
  waits.waits = true;
  expect_known(finder, waits, deg(2, 0));
}

// ---- by the counters
// -------------------------------------------------------------------------------

OffsetMemory stopped() {
  OffsetMemory memory = sent(5);
  memory.ipoc = 4'000'000'000u;
  memory.step = 4;
  memory.seconds_per_ipoc = 0.001;
  memory.t_rx = kThen;
  memory.delay = 10;
  memory.delay_counts = true;
  memory.actual_rad = deg(10, -20);
  return memory;
}
/// This long after it stopped, by the host's clock and by IPOC.
OffsetEvidence after(double elapsed_s, double by_ipoc_s, std::optional<std::uint32_t> delay) {
  OffsetEvidence evidence;
  evidence.t_rx = kThen + std::chrono::microseconds(std::llround(1e6 * elapsed_s));
  evidence.ipoc = 4'000'000'000u + static_cast<std::uint32_t>(std::lround(1000 * by_ipoc_s));
  evidence.actual_rad = deg(10, -20);
  evidence.delay = delay;
  evidence.silence_before_s = elapsed_s;
  return evidence;
}

TEST(OffsetByCounters, ASessionThatIsSeenToBeginHoldsNone) {
  OffsetFinder finder;
  finder.begin(stopped());
  OffsetEvidence evidence = after(1.0, 1.0, 260);
  evidence.session_start = true;
  expect_known(finder, evidence, deg(0, 0));
  // The first packet of a packet counter.
  OffsetEvidence first = after(1.0, 0.0, std::nullopt);
  first.ipoc = 0;
  finder.begin(stopped());
  expect_known(finder, first, deg(0, 0));
  first.delay = 1;
  OffsetMemory memory = stopped();
  memory.delay.reset();
  memory.seconds_per_ipoc = 0.0;
  finder.begin(memory);
  EXPECT_EQ(finder.update(first), OffsetVerdict::kUnknown);
}

TEST(OffsetByCounters, WithoutAMemoryOrListenedSilenceNothingSaysThatItIsNew) {
  OffsetFinder finder;
  finder.begin({});
  OffsetEvidence evidence = after(1.0, 1.0, 0);
  evidence.silence_before_s = 0.19;
  EXPECT_EQ(finder.update(evidence), OffsetVerdict::kUnknown);
  evidence.silence_before_s = 1.0;
  evidence.delay = 1;
  EXPECT_EQ(finder.update(evidence), OffsetVerdict::kUnknown);
  evidence.delay.reset();
  EXPECT_EQ(finder.update(evidence), OffsetVerdict::kUnknown);
}

TEST(OffsetByCounters, WhereHardlyAnyWasSentItIsTheSame) {
  OffsetMemory memory = stopped();
  memory.sent_rad = deg(0.019, 0);
  memory.step = 0;
  OffsetFinder finder;
  finder.begin(memory);
  expect_known(finder, after(1.0, 1.0, 0), deg(0.019, 0));
  memory.sent_rad = deg(0.021, 0);
  finder.begin(memory);
  EXPECT_EQ(finder.update(after(1.0, 1.0, 0)), OffsetVerdict::kUnknown);
}

TEST(OffsetByCounters, WithoutAClockInIpocNothingIsKnown) {
  for (const bool step : {true, false}) {
    OffsetMemory memory = stopped();
    if (step) memory.step = 0;
    if (!step) memory.seconds_per_ipoc = 0.0;
    OffsetFinder finder;
    finder.begin(memory);
    EXPECT_EQ(finder.update(after(1.0, 1.0, 260)), OffsetVerdict::kUnknown);
  }
}

TEST(OffsetByCounters, AnIpocThatDidNotGoOnIsAnotherSession) {
  // Within 50 ms and a hundredth of the time: on either side it may be the same one.
  for (const double side : {1.0, -1.0}) {
    OffsetFinder finder;
    finder.begin(stopped());
    expect_known(finder, after(10.0, 10.0 + side * 0.152, 2520), deg(0, 0));
    finder.begin(stopped());
    const double by_ipoc_s = 10.0 + side * 0.148;
    const auto unanswered = static_cast<std::uint32_t>(std::lround(1000 * by_ipoc_s)) / 4 - 1;
    expect_known(finder, after(10.0, by_ipoc_s, 10 + unanswered), deg(5, 0));
  }
}

TEST(OffsetByCounters, DelayOfTheSameSessionCountsEveryReplyThatWasMissing) {
  // A second at 4 ms: 249 unanswered packets. One of them may not be counted yet.
  OffsetFinder finder;
  finder.begin(stopped());
  expect_known(finder, after(1.0, 1.0, 10 + 249), deg(5, 0));
  expect_known(finder, after(1.0, 1.0, 10 + 248), deg(5, 0));
  EXPECT_EQ(finder.update(after(1.0, 1.0, 10 + 247)), OffsetVerdict::kUnknown);
  // Three fewer belong to another session; and it never decreases.
  expect_known(finder, after(1.0, 1.0, 10 + 246), deg(0, 0));
  finder.begin(stopped());
  expect_known(finder, after(1.0, 1.0, 9), deg(0, 0));
  expect_known(finder, after(1.0, 1.0, 10), deg(0, 0));
}

TEST(OffsetByCounters, ADelayThatWasNeverSeenToCountProvesNothing) {
  OffsetMemory memory = stopped();
  memory.delay_counts = false;
  OffsetFinder finder;
  finder.begin(memory);
  EXPECT_EQ(finder.update(after(1.0, 1.0, 10)), OffsetVerdict::kUnknown);
  EXPECT_EQ(finder.update(after(1.004, 1.004, 10)), OffsetVerdict::kUnknown);
  expect_known(finder, after(1.008, 1.008, 11), deg(0, 0));  // it increased: it counts
  // Neither does a Delay that is not sent.
  finder.begin(memory);
  EXPECT_EQ(finder.update(after(1.0, 1.0, std::nullopt)), OffsetVerdict::kUnknown);
  memory.delay.reset();
  finder.begin(memory);
  EXPECT_EQ(finder.update(after(1.0, 1.0, 259)), OffsetVerdict::kUnknown);
}

TEST(OffsetByCounters, OneThatCountsPacketsGoesOnWhereItStoodHoweverLongItTook) {
  OffsetMemory memory = stopped();
  memory.counts_packets = true;
  memory.step = 1;
  const auto known_after = [&](std::int32_t ahead, double moved_deg) {
    OffsetEvidence evidence = after(60.0, 0.0, std::nullopt);
    evidence.ipoc = memory.ipoc + static_cast<std::uint32_t>(ahead);
    evidence.actual_rad = deg(10 + moved_deg, -20);
    OffsetFinder finder;
    finder.begin(memory);
    EXPECT_EQ(finder.update(evidence), OffsetVerdict::kKnown);
    return finder.offset_rad() == memory.sent_rad;
  };
  EXPECT_TRUE(known_after(0, 0.0));
  EXPECT_TRUE(known_after(4, 0.019));
  EXPECT_FALSE(known_after(5, 0.0));
  EXPECT_FALSE(known_after(-1, 0.0));
  EXPECT_FALSE(known_after(0, 0.021));
  memory.counts_packets = false;
  EXPECT_FALSE(known_after(0, 0.0));
}

// ---- Delay
// -----------------------------------------------------------------------------------------

TEST(DelayWatched, TellsHowManyMoreCameLate) {
  DelayWatch watch;
  EXPECT_EQ(watch.note(std::nullopt), 0u);
  EXPECT_FALSE(watch.last());
  EXPECT_EQ(watch.note(7), 0u) << "nothing to compare with";
  EXPECT_FALSE(watch.counts());
  EXPECT_EQ(watch.note(7), 0u);
  EXPECT_FALSE(watch.counts());
  EXPECT_EQ(watch.note(10), 3u);
  EXPECT_TRUE(watch.counts());
  EXPECT_EQ(watch.note(std::nullopt), 0u);
  EXPECT_EQ(watch.last(), 10u);
  EXPECT_EQ(watch.note(2), 0u) << "counted anew";
  EXPECT_EQ(watch.note(3), 1u);
  EXPECT_TRUE(watch.counts());
}

TEST(DelayWatched, CountsAcceptedRepliesFromTheLastLateOne) {
  DelayWatch watch;
  for (const std::optional<std::uint32_t> delay : {std::optional(7u), std::optional(7u), {}})
    watch.note(delay);
  EXPECT_EQ(watch.accepted_in_a_row(), 3u);
  watch.note(8);
  EXPECT_EQ(watch.accepted_in_a_row(), 0u);
  watch.note(8);
  EXPECT_EQ(watch.accepted_in_a_row(), 1u);
}

TEST(DelayWatched, RepliesAreRefusedWhereAllButTwoAreCountedAsLate) {
  const auto refused = [](int replies, std::uint32_t first, std::uint32_t last,
                          std::uint64_t least) {
    DelayWatch watch;
    watch.note(first);
    watch.begin_answers(first);
    for (int i = 0; i < replies; ++i) watch.replied();
    watch.note(last);
    return watch.refused(least);
  };
  EXPECT_TRUE(refused(10, 5, 13, 10));
  EXPECT_FALSE(refused(10, 5, 12, 10)) << "three of them were taken";
  EXPECT_FALSE(refused(9, 5, 14, 10)) << "too few to say";
  EXPECT_TRUE(refused(12, 5, 17, 10));
  EXPECT_FALSE(refused(10, 50, 40, 10)) << "counted back";
  EXPECT_TRUE(refused(2, 5, 5, 2));
}

TEST(DelayWatched, WithoutDelayOrInAnotherSessionNothingIsRefused) {
  DelayWatch watch;
  watch.begin_answers(std::nullopt);
  for (int i = 0; i < 20; ++i) watch.replied();
  watch.note(100);
  EXPECT_FALSE(watch.refused(10));
  EXPECT_EQ(watch.replies(), 20u);
  watch.begin_answers(100);
  watch.note(130);
  EXPECT_TRUE(watch.refused(10));
  watch.begin_session();
  EXPECT_EQ(watch.replies(), 0u);
  EXPECT_FALSE(watch.refused(0));
  EXPECT_TRUE(watch.counts()) << "what the controller wires stays";
}

// ---- the accumulator, repeats
// ---------------------------------------------------------------------------

TEST(LedgerExact, BeginsWithNoneAndHoldsWhatItIsSet) {
  CorrectionAccumulator absolute(CorrectionMode::kAbsolute, 4, WireAxes(2, false));
  EXPECT_EQ(absolute.held_rad(), (AxisAngles{0.0, 0.0}));
  absolute.set(deg(3, -4));
  const auto held = absolute.hold_deg();
  ASSERT_EQ(held.size(), 2u);
  EXPECT_NEAR(held[0], 3.0, 1e-12);
  EXPECT_NEAR(held[1], -4.0, 1e-12);
  const auto next = absolute.next_deg(deg(3.5, -4.5), {});
  EXPECT_NEAR(next[0], 3.5, 1e-12);
  EXPECT_NEAR(absolute.held_rad()[1], -4.5 * kRadPerDeg, 1e-15);
  EXPECT_NEAR(absolute.again_deg()[1], -4.5, 1e-12);
}

TEST(LedgerExact, RelativeSendsNoMoreThanAStepAndOneUnitAndForgetsNoRounding) {
  CorrectionAccumulator relative(CorrectionMode::kRelative, 4, WireAxes(2, false));
  relative.set(deg(1, -1));
  // 0.00236 deg per reply in units of 0.0001: 23 and one.
  auto sent_deg = relative.next_deg(deg(1.01, -1.01), deg(0.00236, 0.00236));
  EXPECT_NEAR(sent_deg[0], 0.0024, 1e-12);
  EXPECT_NEAR(sent_deg[1], -0.0024, 1e-12);
  EXPECT_NEAR(relative.held_rad()[0], 1.0024 * kRadPerDeg, 1e-12);
  EXPECT_NEAR(relative.held_rad()[1], -1.0024 * kRadPerDeg, 1e-12);
  sent_deg = relative.hold_deg();
  EXPECT_EQ(sent_deg[0], 0.0);
  EXPECT_EQ(sent_deg[1], 0.0);
  EXPECT_NEAR(relative.held_rad()[0], 1.0024 * kRadPerDeg, 1e-12);
  for (int i = 0; i < 3; ++i) relative.next_deg(deg(1.01, -1.01), deg(0.00236, 0.00236));
  EXPECT_NEAR(relative.held_rad()[0], 1.0096 * kRadPerDeg, 1e-12);
  relative.next_deg(deg(1.01, -1.01), deg(0.00236, 0.00236));
  EXPECT_NEAR(relative.again_deg()[0], 0.0004, 1e-12);
  EXPECT_NEAR(relative.held_rad()[0], 1.01 * kRadPerDeg, 1e-12);
}

TEST(RepeatsWatched, TheSamePacketIsOneWithTheSameCountAndTheSameAngles) {
  RepeatWatch watch;
  watch.note(0, deg(1, 2), kThen);
  EXPECT_NEAR(watch.same_s(kThen + 1s), 1.0, 1e-12);
  watch.note(0, deg(1, 2), kThen + 1s);
  EXPECT_NEAR(watch.same_s(kThen + 2s), 2.0, 1e-12);
  watch.note(0, deg(1, 2.001), kThen + 2s);
  EXPECT_NEAR(watch.same_s(kThen + 2s), 0.0, 1e-12);
  watch.note(1, deg(1, 2.001), kThen + 3s);
  EXPECT_NEAR(watch.same_s(kThen + 4s), 1.0, 1e-12);
}

}  // namespace
}  // namespace cellcal::drivers
