// Validation of moves before any motion: the value and its limit.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "drivers/kuka/moves/move_queue.h"
#include "drivers/units.h"
#include "tests/drivers/kuka/expect_cause.h"

namespace cellcal::drivers {
namespace {

const std::vector<AxisLimit> kLimits{{-170 * kRadPerDeg, 170 * kRadPerDeg, 1, 1, 1},
                                     {-90 * kRadPerDeg, 45 * kRadPerDeg, 1, 1, 1}};
constexpr double kCorrectionLimitDeg[] = {30.0, 20.0};

Move to(const AxisAngles& target_rad, double cruise_s = 0.0) {
  return {1, MoveKind::kTransit, target_rad, cruise_s, 0};
}

void expect(const std::optional<Cause>& objection, const Cause& cause) {
  ASSERT_TRUE(objection);
  expect_cause(*objection, cause);
}

TEST(MoveCheck, AnotherNumberOfAxesIsNamedWithBothNumbers) {
  expect(object_to(to({0.0}), kLimits), cause::AxisCount{1, 2});
  expect(object_to(to({0.0, 0.0, 0.0}), kLimits), cause::AxisCount{3, 2});
  EXPECT_FALSE(object_to(to({0.0, 0.0}), kLimits));
}

TEST(MoveCheck, ACruiseTimeThatIsNoneIsNamed) {
  expect(object_to(to({0.0, 0.0}, -1.0), kLimits), cause::BadCruise{-1.0});
  expect(object_to(to({0.0, 0.0}, HUGE_VAL), kLimits), cause::BadCruise{HUGE_VAL});
  expect(object_to(to({0.0, 0.0}, NAN), kLimits), cause::BadCruise{NAN});
  EXPECT_FALSE(object_to(to({0.0, 0.0}, 0.0), kLimits));
  EXPECT_FALSE(object_to(to({0.0, 0.0}, 1.0), kLimits));
}

TEST(MoveCheck, AnAngleThatIsNoNumberIsNamedByItsAxis) {
  expect(object_to(to({NAN, 0.0}), kLimits), cause::NotFinite{0, NAN});
  expect(object_to(to({0.0, HUGE_VAL}), kLimits), cause::NotFinite{1, HUGE_VAL});
}

TEST(MoveCheck, BeyondALimitOfEitherSideIsNamedInDegrees) {
  expect(object_to(to({-171 * kRadPerDeg, 0.0}), kLimits), cause::BelowLimit{0, -171, -170});
  expect(object_to(to({0.0, 46 * kRadPerDeg}), kLimits), cause::AboveLimit{1, 46, 45});
  EXPECT_FALSE(object_to(to({170 * kRadPerDeg, -90 * kRadPerDeg}), kLimits))
      << "the limit itself is inside";
}

TEST(MoveCheck, ACorrectionBeyondItsLimitIsMeasuredFromThePoseAtCorrectionNought) {
  const AxisAngles base{100 * kRadPerDeg, -10 * kRadPerDeg};
  expect(object_to(to({131 * kRadPerDeg, -10 * kRadPerDeg}), kLimits, kCorrectionLimitDeg, base),
         cause::CorrectionLimit{0, 31, 30});
  expect(object_to(to({100 * kRadPerDeg, -31 * kRadPerDeg}), kLimits, kCorrectionLimitDeg, base),
         cause::CorrectionLimit{1, -21, 20});
  EXPECT_FALSE(
      object_to(to({71 * kRadPerDeg, 9 * kRadPerDeg}), kLimits, kCorrectionLimitDeg, base));
  expect(object_to(to({100 * kRadPerDeg}), kLimits, kCorrectionLimitDeg, base),
         cause::AxisCount{1, 2});
}

// ---- way-points --------------------------------------------------------------------------------

Move by(const Via& via, MoveKind kind = MoveKind::kTransit, double cruise_s = 0.0) {
  return {1, kind, {0.0, 0.0}, cruise_s, 0, {{{0.1, 0.1}, 0.5, 0.5}, via}};
}

TEST(MoveCheck, EachWayPointHasToBeWithinTheLimitsAndIsNamedByItsNumber) {
  expect(object_to(by({{0.0}}), kLimits), cause::AxisCount{1, 2, 2});
  expect(object_to(by({{NAN, 0.0}}), kLimits), cause::NotFinite{0, NAN, 2});
  expect(object_to(by({{-171 * kRadPerDeg, 0.0}}), kLimits), cause::BelowLimit{0, -171, -170, 2});
  expect(object_to(by({{0.0, 46 * kRadPerDeg}}), kLimits), cause::AboveLimit{1, 46, 45, 2});
  EXPECT_FALSE(object_to(by({{0.0, 45 * kRadPerDeg}, 0.5, 0.0}), kLimits));
  Move first = by({{0.0, 0.0}});
  first.via[0].at_rad[1] = -91 * kRadPerDeg;
  expect(object_to(first, kLimits), cause::BelowLimit{1, -91, -90, 1});
}

TEST(MoveCheck, SharesAreFromNoughtToAHalf) {
  for (const double share : {-0.1, 0.51, 1.0, HUGE_VAL, -HUGE_VAL, double{NAN}}) {
    expect(object_to(by({{0.0, 0.0}, share, 0.5}), kLimits), cause::BadShare{share, 0.5, 2});
    expect(object_to(by({{0.0, 0.0}, 0.5, share}), kLimits), cause::BadShare{share, 0.5, 2});
  }
}

TEST(MoveCheck, ASearchGoesStraightAndACruiseTimeIsOfOneLine) {
  expect(object_to(by({{0.0, 0.0}}, MoveKind::kSearch, 1.0), kLimits), cause::SearchByWayPoints{2});
  expect(object_to(by({{0.0, 0.0}}, MoveKind::kTransit, 1.0), kLimits),
         cause::CruiseByWayPoints{1});
  expect(object_to(by({{0.0, 0.0}}, MoveKind::kRetreat, 1.0), kLimits),
         cause::CruiseByWayPoints{1});
  EXPECT_FALSE(object_to(by({{0.0, 0.0}}, MoveKind::kRetreat), kLimits));
}

TEST(MoveCheck, ACorrectionBeyondItsLimitAtAWayPointIsNamedToo) {
  expect(
      object_to(by({{0.0, 31 * kRadPerDeg}}), kLimits, kCorrectionLimitDeg, {0.0, 10 * kRadPerDeg}),
      cause::CorrectionLimit{1, 21, 20, 2});
}

}  // namespace
}  // namespace cellcal::drivers
