#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "drivers/kuka/rsi/path_move.h"

namespace cellcal::drivers {
namespace {

constexpr int kCases = 2000;
// Differences of sums of squares and cubes lose digits; limits themselves are met exactly.
constexpr double kRounding = 1e-6;

double spread(std::mt19937_64& random, double low, double high) {  // evenly in the logarithm
  std::uniform_real_distribution<double> exponent(std::log(low), std::log(high));
  return std::exp(exponent(random));
}

struct Peaks {
  double speed = 0, acceleration = 0, jerk = 0;
};

// Largest difference quotients on a grid of n steps: never above the true peak derivative.
template <typename Position>
Peaks peaks(double duration, Position position, int n = 400) {
  const double h = duration / n;
  Peaks most;
  for (int i = -4; i < n + 4; ++i) {
    const double p0 = position(i * h), p1 = position((i + 1) * h), p2 = position((i + 2) * h),
                 p3 = position((i + 3) * h);
    most.speed = std::max(most.speed, std::abs(p1 - p0) / h);
    most.acceleration = std::max(most.acceleration, std::abs(p2 - 2 * p1 + p0) / (h * h));
    most.jerk = std::max(most.jerk, std::abs(p3 - 3 * p2 + 3 * p1 - p0) / (h * h * h));
  }
  return most;
}

TEST(PathMove, SpeedAccelerationAndJerkOfNoAxisAreEverExceeded) {
  std::mt19937_64 random(20261120);
  std::uniform_real_distribution<double> angle(-3.0, 3.0);
  for (int c = 0; c < kCases; ++c) {
    std::vector<AxisLimit> limits(6);
    AxisAngles from, to;
    const double size = spread(random, 1e-3, 1.0);
    for (AxisLimit& limit : limits) {
      limit = {-9, 9, spread(random, 0.01, 10), spread(random, 0.1, 100), spread(random, 1, 1e4)};
      from.push_back(angle(random));
      to.push_back(from.back() + size * angle(random));
    }
    const PathMove move(from, to, limits, 0.0);
    for (std::size_t axis = 0; axis < 6; ++axis) {
      const Peaks most = peaks(move.duration_s(), [&](double t) { return move.at(t)[axis]; });
      ASSERT_LE(most.speed, limits[axis].max_speed_rad_s * (1 + kRounding)) << c;
      ASSERT_LE(most.acceleration, limits[axis].max_acceleration_rad_s2 * (1 + 1e-4)) << c;
      // Third differences of values of size 3 carry rounding of 1e-15 / h^3.
      const double h = move.duration_s() / 400;
      ASSERT_LE(most.jerk, limits[axis].max_jerk_rad_s3 * (1 + 1e-4) + 1e-14 / (h * h * h)) << c;
    }
  }
}

TEST(PathMove, EndsExactlyAtItsTargetAndStaysOnTheLine) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> angle(-3.0, 3.0);
  const std::vector<AxisLimit> limits(6, {-9, 9, 1.0, 5.0, 50.0});
  for (int c = 0; c < kCases; ++c) {
    AxisAngles from, to;
    for (int i = 0; i < 6; ++i) {
      from.push_back(angle(random));
      to.push_back(angle(random));
    }
    const PathMove move(from, to, limits, 0.0);
    EXPECT_EQ(move.at(move.duration_s()), to);
    EXPECT_EQ(move.at(move.duration_s() + 1e9), to);
    EXPECT_EQ(move.at(0.0), from);
    const AxisAngles middle = move.at(move.duration_s() / 2);
    for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(middle[i], (from[i] + to[i]) / 2, 1e-9);
    const double just_before = move.duration_s() * (1 - 1e-9);
    for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(move.at(just_before)[i], to[i], 1e-9);
  }
}

TEST(PathMove, LimitingAxisUsesItsLimits) {
  const std::vector<AxisLimit> limits(1, {-9, 9, 1.0, 5.0, 50.0});
  const PathMove move({0.0}, {3.0}, limits, 0.0);
  // v/a + a/j of ramp at either end, the rest at full speed.
  EXPECT_NEAR(move.duration_s(), 3.0 / 1.0 + 1.0 / 5.0 + 5.0 / 50.0, 1e-12);
  EXPECT_NEAR(move.fastest_axis_rad_s(move.duration_s() / 2), 1.0, 1e-12);
}

TEST(PathMove, CruiseTimeMakesAMoveSlowerNeverFaster) {
  const std::vector<AxisLimit> limits(1, {-9, 9, 1.0, 5.0, 50.0});
  const PathMove slow({0.0}, {1.0}, limits, 10.0);
  EXPECT_NEAR(slow.fastest_axis_rad_s(slow.duration_s() / 2), 0.1, 1e-12);
  const PathMove hasty({0.0}, {1.0}, limits, 1e-6), free({0.0}, {1.0}, limits, 0.0);
  EXPECT_EQ(hasty.duration_s(), free.duration_s());
}

TEST(PathMove, NoTravelTakesNoTime) {
  const std::vector<AxisLimit> limits(2, {-9, 9, 1.0, 5.0, 50.0});
  const PathMove none({1.0, 2.0}, {1.0, 2.0}, limits, 5.0);
  EXPECT_EQ(none.duration_s(), 0.0);
  EXPECT_EQ(none.at(0.0), (AxisAngles{1.0, 2.0}));
}

TEST(Brake, FromAnyInstantOfAnyMoveStopsWithinTheLimitsAndBeforeTheEnd) {
  std::mt19937_64 random(99);
  std::uniform_real_distribution<double> part(0.0, 1.0);
  for (int c = 0; c < kCases; ++c) {
    const ScalarLimits limits{spread(random, 0.01, 10), spread(random, 0.1, 100),
                              spread(random, 1, 1e4)};
    const double distance = spread(random, 1e-4, 10);
    const ScalarProfile travel = ScalarProfile::travel(distance, limits);
    const double at = part(random) * travel.duration_s();
    const ScalarProfile brake = ScalarProfile::brake(travel.at(at), limits);
    const ScalarState end = brake.at(brake.duration_s());
    EXPECT_EQ(end.speed, 0.0);
    EXPECT_EQ(end.acceleration, 0.0);
    EXPECT_LE(end.position, distance * (1 + 1e-9));
    EXPECT_GE(end.position, travel.at(at).position);
    EXPECT_LE(brake.duration_s(), travel.duration_s() - at + 1e-6);
    // Travel up to that instant and braking after it are one smooth motion.
    const auto joined = [&](double t) {
      return t < at ? travel.at(t).position : brake.at(t - at).position;
    };
    const double duration = at + brake.duration_s();
    const Peaks most = peaks(duration, joined);
    const double h = duration / 400;
    ASSERT_LE(most.speed, limits.speed * (1 + kRounding)) << c;
    ASSERT_LE(most.acceleration, limits.acceleration * (1 + 1e-4) + 1e-14 * distance / (h * h))
        << c;
    ASSERT_LE(most.jerk, limits.jerk * (1 + 1e-4) + 1e-14 * distance / (h * h * h)) << c;
  }
}

TEST(Brake, AtRestIsNoMotion) {
  const ScalarProfile brake = ScalarProfile::brake({0.5, 0.0, 0.0}, {1, 5, 50});
  EXPECT_EQ(brake.duration_s(), 0.0);
  EXPECT_EQ(brake.at(1.0).position, 0.5);
}

}  // namespace
}  // namespace cellcal::drivers
