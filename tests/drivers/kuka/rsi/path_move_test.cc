// Moves through way-points: paths, axis limits, brakes.

#include "drivers/kuka/rsi/path_move.h"

#include <gtest/gtest.h>

#include "tests/drivers/kuka/rsi/path_cases.h"

namespace cellcal::drivers {
namespace {

constexpr int kCases = 10000;
constexpr double kRounding = 1e-6;

const std::vector<AxisLimit> kTwoAxes(2, {-9, 9, 1.0, 4.0, 40.0});

double distance(const AxisAngles& a, const AxisAngles& b) {
  double most = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) most = std::max(most, std::abs(a[k] - b[k]));
  return most;
}

/// A right angle: along the first axis, then along the second.
PathCase right_angle(double in_share, double out_share) {
  return {{0.0, 0.0}, {{{1.0, 0.0}, in_share, out_share}}, {1.0, 1.0}, kTwoAxes};
}

double least_distance(const PathMove& move, const AxisAngles& point) {
  double least = HUGE_VAL;
  for (int i = 0; i <= 2000; ++i) {
    least = std::min(least, distance(move.at(move.duration_s() * i / 2000), point));
  }
  return least;
}

TEST(PathOverWayPoints, SpeedAccelerationAndJerkOfNoAxisAreEverExceeded) {
  PathCases cases(20261122);
  for (int c = 0; c < kCases; ++c) {
    const PathCase one = cases.odd();
    const PathMove move = one.move();
    const Peaks most = peaks(move, one.limits, 64);
    ASSERT_LE(most.speed, 1 + kRounding) << c;
    ASSERT_LE(most.acceleration, 1 + kRounding) << c;
    ASSERT_LE(most.jerk, 1 + kRounding) << c;
    if (c % 10 != 0) continue;
    const Peaks seen = differences(one, 200);
    ASSERT_LE(seen.speed, 1 + kRounding) << c;
    ASSERT_LE(seen.acceleration, 1 + 1e-3) << c;
    ASSERT_LE(seen.jerk, 1 + 1e-3) << c;
  }
}

TEST(PathOverWayPoints, ABrakeFromAnyInstantKeepsTheLimitsAndThePath) {
  PathCases cases(7);
  for (int c = 0; c < kCases; ++c) {
    const PathCase one = cases.odd();
    const PathMove whole = one.move();
    for (int i = 0; i < 2; ++i) {
      const double at_s = cases.uniform(0.0, whole.duration_s());
      PathMove braked = whole;
      braked.brake_at(at_s);
      const Peaks most = peaks(braked, one.limits, 32);
      ASSERT_LE(most.speed, 1 + kRounding) << c;
      ASSERT_LE(most.acceleration, 1 + kRounding) << c;
      ASSERT_LE(most.jerk, 1 + kRounding) << c;
      ASSERT_LE(distance(braked.at(0.0), whole.at(at_s)), 1e-9) << c;
      ASSERT_LE(astray_rad(one, braked.at(braked.duration_s())), 1e-6) << c;
      ASSERT_EQ(braked.fastest_axis_rad_s(braked.duration_s()), 0.0) << c;
      // One motion: state and jerk are continuous.
      if (whole.shape().legs() == 0) continue;
      const ScalarState before = whole.profile().at(at_s), behind = braked.profile().at(0.0);
      ASSERT_EQ(before.position, behind.position) << c;
      ASSERT_EQ(before.speed, behind.speed) << c;
      ASSERT_EQ(before.acceleration, behind.acceleration) << c;
    }
  }
}

TEST(PathOverWayPoints, AStartFromRestAtAnyInstantKeepsTheLimitsAndThePath) {
  PathCases cases(17);
  for (int c = 0; c < kCases; ++c) {
    const PathCase one = cases.odd();
    const PathMove whole = one.move();
    PathMove again = whole;
    for (int i = 0; i < 3; ++i) {  // also of one that was started so
      const double at_s = cases.uniform(0.0, again.duration_s());
      const AxisAngles there = again.at(at_s);
      const double left_s = again.duration_s() - at_s;
      again.start_at(at_s);
      const Peaks most = peaks(again, one.limits, 32);
      ASSERT_LE(most.speed, 1 + kRounding) << c;
      ASSERT_LE(most.acceleration, 1 + kRounding) << c;
      ASSERT_LE(most.jerk, 1 + kRounding) << c;
      ASSERT_LE(distance(again.at(0.0), there), 1e-9) << c;
      ASSERT_EQ(again.fastest_axis_rad_s(0.0), 0.0) << c;
      ASSERT_GE(again.duration_s(), left_s - 1e-9) << c;
      ASSERT_EQ(again.at(again.duration_s()), one.to) << c;
      PathMove braked = again;
      braked.brake_at(cases.uniform(0.0, again.duration_s()));
      ASSERT_LE(peaks(braked, one.limits, 32).worst(), 1 + kRounding) << c;
    }
  }
}

TEST(PathOverWayPoints, ItBeginsAndEndsExactlyAndStaysInWhatItsSharesAllow) {
  PathCases cases(3);
  for (int c = 0; c < kCases; ++c) {
    const PathCase one = cases.odd();
    const PathMove move = one.move();
    ASSERT_LE(distance(move.at(0.0), one.from), 1e-11) << c;
    ASSERT_EQ(move.at(move.duration_s()), one.to) << c;
    ASSERT_EQ(move.at(1e9), one.to) << c;
    ASSERT_LE(distance(move.at(move.duration_s() * (1 - 1e-12)), one.to), 1e-9) << c;
    for (int i = 0; i <= 40; ++i) {
      ASSERT_LE(astray_rad(one, move.at(move.duration_s() * i / 40)), 1e-6) << c << " " << i;
    }
  }
}

TEST(PathOverWayPoints, NothingJumpsBetweenLegsAndCorners) {
  PathCases cases(5);
  for (int c = 0; c < 300; ++c) {
    const PathCase one = cases.odd();
    const PathMove move = one.move();
    const double fastest = 10.0;
    AxisAngles before = move.at(0.0);
    for (int i = 1; i <= 1000; ++i) {
      const AxisAngles at = move.at(move.duration_s() * i / 1000);
      ASSERT_LE(distance(at, before), fastest * move.duration_s() / 1000 + 1e-9) << c;
      before = at;
    }
  }
}

TEST(PathOverWayPoints, ACornerIsCutByAsMuchAsItsSharesAllowAndNoMore) {
  // The middle of a corner is at most a quarter of both halves off the way-point.
  const PathMove wide = right_angle(0.5, 0.5).move();
  EXPECT_GT(least_distance(wide, {1.0, 0.0}), 0.03);
  EXPECT_LE(least_distance(wide, {1.0, 0.0}), 0.25 * 0.5);
  const PathMove narrow = right_angle(0.1, 0.5).move();
  EXPECT_LE(least_distance(narrow, {1.0, 0.0}), 0.25 * 0.1 + 1e-6);
  EXPECT_GT(least_distance(narrow, {1.0, 0.0}), 0.0);
}

TEST(PathOverWayPoints, AShareOfNoughtOnEitherSideIsARest) {
  for (const PathCase& one :
       {right_angle(0.0, 0.5), right_angle(0.5, 0.0), right_angle(0.0, 0.0)}) {
    const PathMove move = one.move();
    const PathMove first({0.0, 0.0}, {1.0, 0.0}, kTwoAxes, 0.0);
    EXPECT_NEAR(move.duration_s(), 2 * first.duration_s(), 1e-12);
    EXPECT_NEAR(distance(move.at(first.duration_s()), {1.0, 0.0}), 0.0, 1e-12);
    EXPECT_NEAR(move.fastest_axis_rad_s(first.duration_s()), 0.0, 1e-9);
  }
}

TEST(PathOverWayPoints, AWayPointThatIsThereTwiceIsARest) {
  PathCase one = right_angle(0.5, 0.5);
  one.vias.push_back(one.vias.back());
  EXPECT_NEAR(one.move().duration_s(), one.with_stops().duration_s(), 1e-12);
  EXPECT_NEAR(least_distance(one.move(), {1.0, 0.0}), 0.0, 1e-6);
}

TEST(PathOverWayPoints, PassingIsFasterThanStopping) {
  // At full speed around the corner, only the ramps at both ends are left.
  EXPECT_NEAR(right_angle(0.5, 0.5).move().duration_s(), 2.0 / 1.0 + 1.0 / 4.0 + 4.0 / 40.0, 1e-6);
  EXPECT_NEAR(right_angle(0.0, 0.0).move().duration_s(), 2 * 1.35, 1e-9);
  PathCases cases(11);
  double passed_s = 0.0, stopped_s = 0.0;
  for (int c = 0; c < 500; ++c) {
    const PathCase one = cases.usual(4);
    passed_s += one.move().duration_s();
    stopped_s += one.with_stops().duration_s();
    ASSERT_LE(one.move().duration_s(), one.with_stops().duration_s() * (1 + 1e-9)) << c;
  }
  EXPECT_LT(passed_s, 0.86 * stopped_s);
  for (int c = 0; c < 2000; ++c) {
    const PathCase one = cases.odd();
    ASSERT_LE(one.move().duration_s(), one.with_stops().duration_s() * (1 + 1e-9)) << c;
  }
}

TEST(PathOverWayPoints, WithoutWayPointsItIsTheStraightLine) {
  PathCases cases(13);
  for (int c = 0; c < 1000; ++c) {
    PathCase one = cases.odd();
    one.vias.clear();
    const PathMove move = one.move();
    if (move.shape().legs() == 0) continue;
    const ScalarProfile travel = ScalarProfile::travel(1.0, move.shape().leg(0).limits);
    ASSERT_EQ(move.duration_s(), travel.duration_s());
    for (int i = 0; i < 20; ++i) {
      const double t = move.duration_s() * i / 20, s = travel.at(t).position;
      for (std::size_t k = 0; k < one.from.size(); ++k) {
        ASSERT_EQ(move.at(t)[k], one.from[k] + s * (one.to[k] - one.from[k])) << "to the bit";
      }
    }
  }
}

TEST(PathOverWayPoints, TheFirstLegIsOverWhereItsCornerBeginsOrWhereItRests) {
  const PathMove passed = right_angle(0.5, 0.5).move(), rested = right_angle(0.0, 0.0).move();
  EXPECT_NEAR(passed.at(passed.first_leg_s())[0], 1.0 - passed.shape().corner(0).half, 1e-9);
  EXPECT_NEAR(rested.at(rested.first_leg_s())[0], 1.0, 1e-9);
  PathCase nowhere = right_angle(0.5, 0.5);
  nowhere.vias.insert(nowhere.vias.begin(), {nowhere.from, 0.5, 0.5});
  EXPECT_EQ(nowhere.move().first_leg_s(), 0.0) << "the first way-point is where it stands";
}

TEST(PathOverWayPoints, ABrakeInTimeStaysOnThePathBeyondTheLimits) {
  PathMove move = right_angle(0.5, 0.5).move();
  const PathCase one = right_angle(0.5, 0.5);
  for (const double share : {0.2, 0.4, 0.5, 0.6, 0.8}) {
    PathMove braked = move;
    braked.brake_within(share * move.duration_s(), 0.02);
    EXPECT_LE(braked.duration_s(), 0.02);
    EXPECT_LE(astray_rad(one, braked.at(1.0)), 1e-9);
    EXPECT_EQ(braked.fastest_axis_rad_s(1.0), 0.0);
  }
}

}  // namespace
}  // namespace cellcal::drivers
