// The record of packets by itself: content, means, ranges, and position at an instant.

#include "drivers/kuka/moves/position_record.h"

#include <gtest/gtest.h>

#include <cmath>

#include "drivers/units.h"

namespace cellcal::drivers {
namespace {

TimePoint at_ms(double ms) {
  return TimePoint{std::chrono::seconds(50)} + std::chrono::microseconds(std::llround(1000 * ms));
}

/// Packets every 4 ms; packet n shows n on A1, minus n on A2, and 10 n commanded.
PositionRecord of(int packets, std::uint32_t first_ipoc = 100) {
  PositionRecord record;
  for (int n = 0; n < packets; ++n) {
    record.push(at_ms(4.0 * n), first_ipoc + 4 * static_cast<std::uint32_t>(n), {1.0 * n, -1.0 * n},
                {10.0 * n, -10.0 * n});
  }
  return record;
}

TEST(PositionRecord, KeepsTheNewest512InOrder) {
  const int packets = static_cast<int>(PositionRecord::kDepth) + 37;
  const PositionRecord record = of(packets);
  EXPECT_EQ(record.size(), PositionRecord::kDepth);
  for (std::size_t back = 0; back < PositionRecord::kDepth; ++back) {
    const int n = packets - 1 - static_cast<int>(back);
    ASSERT_EQ(record.newest(back).actual_rad[0], n);
    ASSERT_EQ(record.newest(back).commanded_rad[1], -10.0 * n);
    ASSERT_EQ(record.newest(back).ipoc, 100u + 4u * static_cast<std::uint32_t>(n));
    ASSERT_EQ(record.newest(back).t_rx, at_ms(4.0 * n));
  }
  EXPECT_EQ(of(PositionRecord::kDepth - 1).size(), PositionRecord::kDepth - 1);
  EXPECT_EQ(of(PositionRecord::kDepth).size(), PositionRecord::kDepth);
}

TEST(PositionRecord, BeginsAnew) {
  PositionRecord record = of(700);
  record.clear();
  EXPECT_EQ(record.size(), 0u);
  EXPECT_FALSE(record.rests(1));
  EXPECT_FALSE(record.actual_at(at_ms(0), 0.001));
  record.push(at_ms(9000), 7, {5.0, 6.0}, {7.0, 8.0});
  EXPECT_EQ(record.size(), 1u);
  EXPECT_EQ(record.newest().actual_rad[1], 6.0);
}

TEST(PositionRecord, WhatWasCommandedInReplyIsTheNewestPacketsAlone) {
  for (const int packets : {1, 2, 511, 512, 513}) {
    PositionRecord record = of(packets);
    record.set_commanded({77.0, 88.0});
    EXPECT_EQ(record.newest().commanded_rad, (AxisAngles{77.0, 88.0}));
    EXPECT_EQ(record.newest().actual_rad[0], packets - 1);
    if (packets == 1) continue;
    EXPECT_EQ(record.newest(1).commanded_rad[0], 10.0 * (packets - 2));
  }
  PositionRecord empty;
  empty.set_commanded({1.0});
  EXPECT_EQ(empty.size(), 0u);
  empty.push(at_ms(0), 1, {2.0}, {3.0});
  EXPECT_EQ(empty.newest().commanded_rad[0], 3.0);
}

TEST(PositionRecord, MeansReachBackAsFarAsTheRecordDoes) {
  const PositionRecord record = of(10);
  EXPECT_EQ(record.mean_actual_rad(0, 1), (AxisAngles{9.0, -9.0}));
  EXPECT_EQ(record.mean_actual_rad(0, 3), (AxisAngles{8.0, -8.0}));
  EXPECT_EQ(record.mean_actual_rad(4, 2), (AxisAngles{4.5, -4.5}));
  EXPECT_EQ(record.mean_actual_rad(7, 3), (AxisAngles{1.0, -1.0}));
  EXPECT_EQ(record.mean_actual_rad(7, 100), (AxisAngles{1.0, -1.0}));
}

TEST(PositionRecord, RestIsTwoMeansWithinTwoThousandthsOfADegree) {
  for (const double apart_deg : {0.0019, 0.0021, -0.0019, -0.0021}) {
    PositionRecord record;
    for (int i = 0; i < 7; ++i) record.push(at_ms(4 * i), 0, {0.0, 5.0}, {0.0, 0.0});
    EXPECT_FALSE(record.rests(4)) << "too few";
    record.clear();
    for (int i = 0; i < 4; ++i) record.push(at_ms(4 * i), 0, {0.0, 5.0}, {0.0, 0.0});
    for (int i = 0; i < 4; ++i)
      record.push(at_ms(4 * i), 0, {0.0, 5.0 + apart_deg * kRadPerDeg}, {0.0, 0.0});
    EXPECT_EQ(record.rests(4), std::abs(apart_deg) < 0.002);
  }
}

TEST(PositionRecord, RangesAreOfTheNewestSoMany) {
  PositionRecord record;
  for (const double commanded : {9.0, -9.0, 3.0, 1.0, 2.0}) {
    record.push(at_ms(0), 0, {0.0, 0.0}, {0.0, commanded});
  }
  const auto expect = [&](std::size_t count, double min, double max) {
    EXPECT_EQ(record.commanded_range_rad(1, count).min, min) << count;
    EXPECT_EQ(record.commanded_range_rad(1, count).max, max) << count;
  };
  expect(1, 2, 2);
  expect(2, 1, 2);
  expect(3, 1, 3);
  expect(4, -9, 3);
  expect(5, -9, 9);
  expect(600, -9, 9);
  EXPECT_EQ(record.commanded_range_rad(0, 5).max, 0.0);
}

TEST(PositionRecord, TellsWhereTheArmWasBetweenTwoPackets) {
  for (const std::uint32_t first : {100u, 0xFFFFFFF0u}) {  // IPOC may wrap
    const PositionRecord record = of(10, first);
    for (const double ms : {0.0, 0.5, 4.0, 17.0, 31.9, 35.9, 36.0}) {
      const auto angles = record.actual_at(at_ms(ms), 0.001);
      ASSERT_TRUE(angles) << ms;
      EXPECT_NEAR((*angles)[0], ms / 4, 1e-6);
      EXPECT_NEAR((*angles)[1], -ms / 4, 1e-6);
    }
    EXPECT_FALSE(record.actual_at(at_ms(36.1), 0.001));
    EXPECT_FALSE(record.actual_at(at_ms(-0.1), 0.001));
  }
}

TEST(PositionRecord, NeedsTwoPacketsToSayWhereTheArmWas) {
  EXPECT_FALSE(of(1).actual_at(at_ms(0), 0.001));
  const auto angles = of(2).actual_at(at_ms(1), 0.001);
  ASSERT_TRUE(angles);
  EXPECT_NEAR((*angles)[0], 0.25, 1e-6);
}

TEST(PositionRecord, PacketsThatCameLateDoNotShiftTheMap) {
  // All but one are late; the earliest is first, in the middle or last.
  for (const int early : {0, 5, 9}) {
    PositionRecord record;
    for (int n = 0; n < 10; ++n) {
      const double late_ms = n == early ? 0.0 : 1.0 + 0.1 * n;
      record.push(at_ms(4.0 * n + late_ms), 100 + 4 * static_cast<std::uint32_t>(n), {1.0 * n},
                  {0.0});
    }
    for (const double ms : {1.0, 18.0, 35.0}) {
      const auto angles = record.actual_at(at_ms(ms), 0.001);
      ASSERT_TRUE(angles) << early << " " << ms;
      EXPECT_NEAR((*angles)[0], ms / 4, 1e-6) << early;
    }
  }
}

TEST(PositionRecord, AStampBeyondItsSuccessorDoesNotShiftTheMap) {
  PositionRecord record;
  for (int n = 0; n < 20; ++n) {
    const std::uint32_t damage = n == 5 ? 70 : 0;
    record.push(at_ms(4.0 * n), 100 + 4 * static_cast<std::uint32_t>(n) + damage, {1.0 * n, 0.0},
                {0.0, 0.0});
  }
  const auto angles = record.actual_at(at_ms(60), 0.001);
  ASSERT_TRUE(angles);
  EXPECT_NEAR((*angles)[0], 15.0, 1e-9);
}

TEST(FarthestAxis, IsNamedWithItsDistance) {
  const AxisDistance most = farthest_axis({1.0, 2.0, 3.0}, {1.5, 1.0, 3.2});
  EXPECT_EQ(most.axis, 1);
  EXPECT_EQ(most.rad, 1.0);
  EXPECT_EQ(farthest_axis({1.0}, {1.0}).rad, 0.0);
  EXPECT_EQ(farthest_axis({1.0, 5.0}, {1.0}).rad, 0.0) << "of the axes that both have";
  EXPECT_EQ(farthest_axis({1.0}, {1.0, 5.0}).rad, 0.0);
}

TEST(PositionRecord, TheEarliestArrivalCountsWhereverItIsInTheRecord) {
  constexpr int kPackets = 10;
  for (int early = 0; early < kPackets; ++early) {
    PositionRecord record;
    for (int n = 0; n < kPackets; ++n) {
      record.push(at_ms(4.0 * n + (n == early ? 0.0 : 3.0)), 4u * static_cast<std::uint32_t>(n),
                  {1.0 * n}, {0.0});
    }
    const auto angles = record.actual_at(at_ms(20), 0.001);
    ASSERT_TRUE(angles) << early;
    EXPECT_NEAR((*angles)[0], 5.0, 1e-9) << early;
  }
}

}  // namespace
}  // namespace cellcal::drivers
