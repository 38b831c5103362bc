// Exact properties of motion: ends, shortest travel, hardness of a brake.

#include <gtest/gtest.h>

#include <cmath>

#include "drivers/kuka/rsi/path_move.h"

namespace cellcal::drivers {
namespace {

const std::vector<AxisLimit> kOneAxis(1, {-9, 9, 1.0, 5.0, 50.0});

TEST(Travel, EndsAtRestAtTheVeryDistance) {
  for (const double distance : {1e-6, 0.013, 0.37, 1.0, 7.3}) {
    const ScalarProfile travel = ScalarProfile::travel(distance, {1.0, 5.0, 50.0});
    for (const double after_s : {0.0, 1.0}) {
      const ScalarState end = travel.at(travel.duration_s() + after_s);
      EXPECT_EQ(end.position, distance);
      EXPECT_EQ(end.speed, 0.0);
      EXPECT_EQ(end.acceleration, 0.0);
    }
    const ScalarState begin = travel.at(-1.0);
    EXPECT_EQ(begin.position, 0.0);
    EXPECT_EQ(begin.speed, 0.0);
  }
}

// For any active limits: full speed with and without constant acceleration, and neither reached.
TEST(Travel, IsNoSlowerThanItsLimitsAskFor) {
  const auto duration = [](double distance, const ScalarLimits& limits) {
    return ScalarProfile::travel(distance, limits).duration_s();
  };
  EXPECT_NEAR(duration(3.0, {1.0, 5.0, 50.0}), 3.0 + 0.2 + 0.1, 1e-12);
  EXPECT_NEAR(duration(3.0, {1.0, 50.0, 25.0}), 3.0 + 2 * std::sqrt(1.0 / 25.0), 1e-12);
  // Acceleration reached, speed not: T = a/j + sqrt((a/j)^2 + 4 d/a).
  EXPECT_NEAR(duration(0.15, {1.0, 5.0, 50.0}), 0.1 + std::sqrt(0.01 + 0.12), 1e-12);
  // Neither: four pieces of full jerk, d = 2 j t^3.
  EXPECT_NEAR(duration(0.05, {1.0, 5.0, 50.0}), 4 * std::cbrt(0.05 / 100.0), 1e-12);
}

TEST(Travel, OfNoDistanceIsNone) {
  EXPECT_EQ(ScalarProfile::travel(0.0, {1, 5, 50}).duration_s(), 0.0);
  EXPECT_EQ(ScalarProfile::travel(-1.0, {1, 5, 50}).duration_s(), 0.0);
  EXPECT_EQ(ScalarProfile().at(1.0).position, 0.0);
}

TEST(PathMove, LessThanAThousandthOfTheLastDecimalOnTheWireIsNoTravel) {
  EXPECT_EQ(PathMove({0.0}, {0.9e-11}, kOneAxis, 0.0).duration_s(), 0.0);
  EXPECT_EQ(PathMove({0.0}, {0.9e-11}, kOneAxis, 0.0).at(0.0), (AxisAngles{0.9e-11}));
  EXPECT_GT(PathMove({0.0}, {1.1e-11}, kOneAxis, 0.0).duration_s(), 0.0);
  // An axis at rest does not limit moving ones.
  const std::vector<AxisLimit> limits{{-9, 9, 1.0, 5.0, 50.0}, {-9, 9, 1e-14, 1e-14, 1e-14}};
  EXPECT_EQ(PathMove({0.0, 0.0}, {1.0, 0.9e-11}, limits, 0.0).duration_s(),
            PathMove({0.0}, {1.0}, kOneAxis, 0.0).duration_s());
}

TEST(PathMove, EachAxisBindsByItsShareOfTheLine) {
  const std::vector<AxisLimit> limits{
      {-9, 9, 1.0, 5.0, 50.0}, {-9, 9, 0.1, 5.0, 50.0}, {-9, 9, 1.0, 0.5, 50.0}};
  const auto slow = [&](const AxisAngles& to) {
    const PathMove move({0.0, 0.0, 0.0}, to, limits, 0.0);
    return move.fastest_axis_rad_s(move.duration_s() / 2);
  };
  EXPECT_NEAR(slow({1.0, 0.5, 0.0}), 0.2, 1e-12) << "the second at 0.1, half of the line";
  EXPECT_NEAR(slow({-3.0, 0.1, 0.0}), 1.0, 1e-12);
  EXPECT_NEAR(slow({3.0, 0.0, -3.0}), 1.0, 1e-12);
}

TEST(PathMove, ABrakeInTimeIsNoHarderThanItMustBe) {
  for (const double longest_s : {0.01, 0.02, 0.05, 0.1}) {
    PathMove move({0.0}, {3.0}, kOneAxis, 0.0);
    const double at_s = move.duration_s() / 2;
    const AxisAngles before = move.at(at_s);
    move.brake_within(at_s, longest_s);
    EXPECT_LE(move.duration_s(), longest_s);
    EXPECT_GT(move.duration_s(), longest_s / 1.25);
    EXPECT_EQ(move.at(0.0), before);
    EXPECT_LT(move.at(1e9)[0], before[0] + longest_s);
    EXPECT_EQ(move.at(1e9), move.at(move.duration_s()));
    EXPECT_EQ(move.fastest_axis_rad_s(1e9), 0.0);
  }
  // Limits are kept if they are sufficient.
  PathMove gentle({0.0}, {3.0}, kOneAxis, 0.0), limited({0.0}, {3.0}, kOneAxis, 0.0);
  gentle.brake_within(1.0, 10.0);
  limited.brake_at(1.0);
  EXPECT_EQ(gentle.duration_s(), limited.duration_s());
  EXPECT_NEAR(limited.duration_s(), 1.0 / 5.0 + 5.0 / 50.0, 1e-9);
}

TEST(PathMove, BrakedWithoutTravelStaysWhereItIs) {
  PathMove none({1.0}, {1.0}, kOneAxis, 0.0);
  none.brake_within(0.0, 0.0);
  EXPECT_EQ(none.duration_s(), 0.0);
  EXPECT_EQ(none.at(0.0), (AxisAngles{1.0}));
}

TEST(Brake, InsideOfAnotherBrakeGoesOnWithIt) {
  const ScalarLimits limits{1.0, 5.0, 50.0};
  const ScalarProfile first = ScalarProfile::brake({0.0, 1.0, 0.0}, limits);
  EXPECT_NEAR(first.duration_s(), 0.3, 1e-12);
  EXPECT_NEAR(first.at(1.0).position, 0.15, 1e-12);
  for (const double at_s : {0.05, 0.15, 0.25, 0.29}) {
    const ScalarProfile second = ScalarProfile::brake(first.at(at_s), limits);
    EXPECT_NEAR(second.duration_s(), 0.3 - at_s, 1e-9);
    EXPECT_NEAR(second.at(1.0).position, 0.15, 1e-9);
  }
  // While accelerating, the acceleration is first reduced to zero: a + a^2 / 2j of additional
  // speed.
  const ScalarProfile rising = ScalarProfile::brake({0.0, 0.5, 3.0}, limits);
  EXPECT_NEAR(rising.at(0.06).acceleration, 0.0, 1e-12);
  EXPECT_NEAR(rising.at(0.06).speed, 0.5 + 9.0 / 100.0, 1e-12);
  EXPECT_EQ(rising.at(1e9).speed, 0.0);
}

}  // namespace
}  // namespace cellcal::drivers
