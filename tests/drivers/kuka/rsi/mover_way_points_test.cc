// Moves through way-points: stops, rest positions, refusals.

#include "drivers/units.h"
#include "tests/drivers/kuka/rsi/mover_rig.h"

namespace cellcal::drivers {
namespace {

using namespace std::chrono_literals;

/// Via 10 deg of A1 to 10 deg of A2: a right angle.
struct ByWayPoint : testing::Test {
  std::optional<CoreResult> begin(MoveKind kind, double in_share = 0.5, double out_share = 0.5) {
    AxisAngles via = rig.commanded, target = rig.commanded;
    via[0] += 10 * kRadPerDeg;
    target[0] += 10 * kRadPerDeg;
    target[1] += 10 * kRadPerDeg;
    rig.mover.listen(rig.now);
    return rig.mover.start({++rig.id, kind, target, 0.0, 0, {{via, in_share, out_share}}},
                           rig.commanded);
  }
  double a1() const { return rig.commanded[0] / kRadPerDeg; }
  double a2() const { return rig.commanded[1] / kRadPerDeg; }
  /// On the first leg, on the second, or in the triangle between their halves.
  bool on_path() const {
    constexpr double kNear = 1e-9;
    const bool first = std::abs(a2()) < kNear && a1() > -kNear && a1() < 10 + kNear;
    const bool second = std::abs(a1() - 10) < kNear && a2() > -kNear && a2() < 10 + kNear;
    const bool corner = a1() <= 10 + kNear && a2() >= -kNear && 10 - a1() + a2() <= 5 + kNear;
    return first || second || corner;
  }
  MoverRig::End end_on_path() {
    for (int cycles = 0; true; ++cycles) {
      if (cycles > 3000) return {};
      const AxisAngles before = rig.commanded;
      EXPECT_TRUE(on_path()) << a1() << " " << a2();
      if (const auto result = rig.cycle()) return {*result, 0, 0};
      for (std::size_t i = 0; i < 3; ++i)
        EXPECT_LE(std::abs(rig.commanded[i] - before[i]), 100 * kRadPerDeg * 0.004 * (1 + 1e-9));
    }
  }
  void run_to(double a1_deg, double a2_deg) {
    while (a1() < a1_deg || a2() < a2_deg) ASSERT_FALSE(rig.cycle());
  }
  double fastest_step_deg() {
    const AxisAngles before = rig.commanded;
    EXPECT_FALSE(rig.cycle());
    return farthest_axis(before, rig.commanded).rad / kRadPerDeg;
  }

  MoverRig rig;
};

TEST_F(ByWayPoint, NoAxisIsFasterThanTheShareOfItsLimitThatTheMoveStates) {
  AxisAngles via = rig.commanded, target = rig.commanded;
  via[0] += 10 * kRadPerDeg;
  target[0] += 10 * kRadPerDeg;
  target[1] += 10 * kRadPerDeg;
  rig.mover.listen(rig.now);
  Move move{++rig.id, MoveKind::kTransit, target, 0.0, 0, {{via, 0.5, 0.5}}};
  move.speed_share = 0.2;
  ASSERT_FALSE(rig.mover.start(move, rig.commanded));
  double fastest = 0.0;
  while (a2() < 9.9) fastest = std::max(fastest, fastest_step_deg());
  const double limit_deg = 100 * 0.004;
  EXPECT_LE(fastest, 0.2 * limit_deg * (1 + 1e-9));
  EXPECT_GE(fastest, 0.19 * limit_deg);
}

TEST_F(ByWayPoint, TheArmPassesItWithoutAStopAndEndsAtTheTarget) {
  ASSERT_FALSE(begin(MoveKind::kTransit));
  double slowest = 1.0;
  while (a2() < 5.0) {
    const double step = fastest_step_deg();
    if (a1() > 5.0) slowest = std::min(slowest, step);
    ASSERT_TRUE(on_path()) << a1() << " " << a2();
  }
  EXPECT_GT(slowest / 0.004, 10.0) << "deg/s";
  const auto end = rig.end();
  expect_end(end.result, MoveOutcome::kArrived, cause::None{});
  EXPECT_NEAR(a1(), 10.0, 1e-12);
  EXPECT_NEAR(a2(), 10.0, 1e-12);
  EXPECT_EQ(end.motionless, 12) << "it settles at the end alone";
}

TEST_F(ByWayPoint, WhereItIsToRestItGoesOnAtOnce) {
  ASSERT_FALSE(begin(MoveKind::kTransit, 0.0, 0.0));
  int resting = 0;
  while (a2() < 1.0) {
    const double step = fastest_step_deg();
    ASSERT_TRUE(std::abs(a2()) < 1e-9 || std::abs(a1() - 10) < 1e-9);
    if (step < 1e-9) ++resting;
  }
  EXPECT_LE(resting, 2);
}

TEST_F(ByWayPoint, AContactOnTheSecondLegOfATransitStopsItThere) {
  ASSERT_FALSE(begin(MoveKind::kTransit));
  run_to(10.0 - 1e-9, 0.0);
  const double from = a2();
  rig.guard.touch(true);
  const auto end = end_on_path();
  expect_end(end.result, MoveOutcome::kUnexpectedContact, cause::TouchedOutsideSearch{});
  EXPECT_NEAR(a1(), 10.0, 1e-9);
  EXPECT_GT(a2(), from);
  EXPECT_LT(a2(), 10.0);
}

TEST_F(ByWayPoint, AStopInTheCornerRestsOnThePath) {
  for (const double at_deg : {5.5, 7.0, 8.5, 9.5, 9.9}) {
    rig.commanded.assign(3, 0.0);
    for (int i = 0; i < 120; ++i) rig.cycle();
    ASSERT_FALSE(begin(MoveKind::kTransit));
    run_to(at_deg, -1.0);
    ASSERT_GT(a2(), 0.0) << "in the corner";
    rig.mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
    const auto end = end_on_path();
    expect_end(end.result, MoveOutcome::kStopped, cause::StopAsked{});
    EXPECT_TRUE(on_path());
    EXPECT_EQ(end.result.at_rad, rig.commanded);
    EXPECT_LT(a2(), 9.0);
  }
}

TEST_F(ByWayPoint, ARetreatThatOpensItsContactInTimeGoesOn) {
  rig.guard.touch(true);
  ASSERT_FALSE(begin(MoveKind::kRetreat));
  run_to(4.0, -1.0);
  rig.guard.touch(false);
  expect_end(rig.end().result, MoveOutcome::kArrived, cause::None{});
  EXPECT_NEAR(a2(), 10.0, 1e-12);
}

TEST_F(ByWayPoint, ARetreatStillInContactWhereItLeavesItsFirstLegIsStopped) {
  for (const double in_share : {0.5, 0.1, 0.0}) {
    rig.commanded.assign(3, 0.0);
    for (int i = 0; i < 120; ++i) rig.cycle();
    rig.guard.touch(true);
    ASSERT_FALSE(begin(MoveKind::kRetreat, in_share));
    const auto end = end_on_path();
    expect_end(end.result, MoveOutcome::kStillInContact, cause::ContactNotOpen{});
    EXPECT_GE(a1(), 10 - 10 * in_share - 1e-3);
    EXPECT_LT(a2(), in_share == 0.0 ? 1e-9 : 8.0);
  }
}

TEST_F(ByWayPoint, AfterARetreatHasOpenedAContactIsUnexpected) {
  rig.guard.touch(true);
  ASSERT_FALSE(begin(MoveKind::kRetreat));
  run_to(0.2, -1.0);
  rig.guard.touch(false);
  run_to(10.0 - 1e-9, 5.5);
  rig.guard.touch(true);
  expect_end(end_on_path().result, MoveOutcome::kUnexpectedContact, cause::TouchedOutsideSearch{});
  EXPECT_LT(a2(), 10.0);
}

TEST_F(ByWayPoint, ARetreatWithoutASensorAsksForNoContact) {
  MoverRig blind(0.004, false);
  AxisAngles via = blind.commanded, target = blind.commanded;
  via[0] += 10 * kRadPerDeg;
  target[1] += 10 * kRadPerDeg;
  ASSERT_FALSE(blind.mover.start({1, MoveKind::kRetreat, target, 0.0, 0, {{via, 0.5, 0.5}}},
                                 blind.commanded));
  blind.id = 1;
  expect_end(blind.end().result, MoveOutcome::kArrived, cause::None{});
}

// Shift, rotation and singularities are checked along straight lines.
TEST_F(ByWayPoint, CorrectionsInSpaceRestAtEachWayPoint) {
  rig.config.space.on = true;
  ASSERT_FALSE(begin(MoveKind::kTransit));
  double nearest = 10.0;
  while (a2() < 5.0) {
    ASSERT_FALSE(rig.cycle());
    ASSERT_TRUE(std::abs(a2()) < 1e-9 || std::abs(a1() - 10) < 1e-9) << a1() << " " << a2();
    nearest = std::min(nearest, std::hypot(a1() - 10, a2()));
  }
  EXPECT_LT(nearest, 0.05);
}

}  // namespace
}  // namespace cellcal::drivers
