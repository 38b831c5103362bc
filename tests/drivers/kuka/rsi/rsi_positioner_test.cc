// A positioner of two axes and a six-axis arm, rotated by its own corrections: E1 and E2. E3 is not moved.

#include <algorithm>
#include <string>

#include "drivers/error.h"
#include "tests/drivers/kuka/rsi/rig.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

constexpr std::size_t kTilt = 6, kTurn = 7;
// Like A1's, but slower.
constexpr double kSpeed = 40 * kDeg, kAcceleration = 80 * kDeg, kJerk = 400 * kDeg;

RsiConfig with_table(CorrectionMode mode = CorrectionMode::kAbsolute) {
  RsiConfig config = rig_config();
  for (const double limit_deg : {60.0, 185.0}) {
    config.limits.push_back({-limit_deg * kDeg, limit_deg * kDeg, kSpeed, kAcceleration, kJerk});
    config.correction_limit_deg.push_back(2 * limit_deg + 1.0);
  }
  config.mode = mode;
  config.hold_on = mode == CorrectionMode::kAbsolute;
  return config;
}

sim::ControllerConfig controller_with_table(CorrectionMode mode = CorrectionMode::kAbsolute) {
  sim::ControllerConfig config;
  config.start_rad.insert(config.start_rad.end(), {5.0 * kDeg, -20.0 * kDeg, 12.5 * kDeg});
  config.noise_sigma_deg = 0.0005;
  config.clamp_external = config.monitor_external = {121.0, 371.0, 0.0};
  if (mode == CorrectionMode::kRelative) {
    config.mode = sim::RsiMode::kRelative;
    config.hold_on = false;
  }
  return config;
}

struct TableRig : Rig {
  explicit TableRig(CorrectionMode mode = CorrectionMode::kAbsolute)
      : Rig(controller_with_table(mode), with_table(mode)) {
    make_ready();
  }
  double actual_deg(std::size_t axis) const { return krc.actual_rad_at(now)[axis] / kDeg; }
  AxisAngles turned_by(double tilt_deg, double turn_deg) const {
    AxisAngles target = commanded();
    target[kTilt] += tilt_deg * kDeg;
    target[kTurn] += turn_deg * kDeg;
    return target;
  }
};

class RsiPositioner : public ::testing::TestWithParam<CorrectionMode> {};
INSTANTIATE_TEST_SUITE_P(Modes, RsiPositioner,
                         ::testing::Values(CorrectionMode::kAbsolute, CorrectionMode::kRelative),
                         [](const auto& mode) {
                           return mode.param == CorrectionMode::kAbsolute ? "absolute" : "relative";
                         });

TEST_P(RsiPositioner, IsTurnedByItsOwnCorrectionsWhileTheArmRests) {
  TableRig rig(GetParam());
  ASSERT_EQ(rig.core.state().actual_rad.size(), 8u);
  EXPECT_FALSE(rig.core.state().linear_unit);
  const AxisAngles from = rig.commanded();
  const CoreResult result = rig.move(MoveKind::kTransit, rig.turned_by(30, -120));
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived) << words(result);
  EXPECT_NEAR(rig.actual_deg(kTilt), 35.0, 0.01);
  EXPECT_NEAR(rig.actual_deg(kTurn), -140.0, 0.01);
  EXPECT_NEAR(rig.krc.correction_deg()[kTilt], 30.0, 0.01);
  EXPECT_NEAR(rig.krc.correction_deg()[kTurn], -120.0, 0.01);
  for (std::size_t i = 0; i < kTilt; ++i)
    EXPECT_NEAR(rig.krc.setpoint_rad()[i], from[i], 1e-5) << i;
  EXPECT_EQ(rig.krc.correction_deg()[8], 0.0) << "E3";
  // Then the arm continues, and the table is at rest.
  const CoreResult onward = rig.move(MoveKind::kTransit, rig.moved_by(0, 20));
  EXPECT_EQ(onward.outcome, MoveOutcome::kArrived) << words(onward);
  EXPECT_NEAR(rig.actual_deg(kTurn), -140.0, 0.01);
}

TEST_P(RsiPositioner, KeepsItsSpeedAccelerationAndJerk) {
  TableRig rig(GetParam());
  double at = rig.krc.setpoint_rad()[kTurn], speed = 0.0, change = 0.0;
  double fastest = 0.0, hardest = 0.0, sharpest = 0.0;
  constexpr double kCycleS = 0.004;
  rig.begin(MoveKind::kTransit, rig.turned_by(0, 150));
  rig.run_until([&] {
    const double now_at = rig.krc.setpoint_rad()[kTurn], now_speed = (now_at - at) / kCycleS;
    const double now_change = (now_speed - speed) / kCycleS;
    fastest = std::max(fastest, std::abs(now_speed));
    hardest = std::max(hardest, std::abs(now_change));
    sharpest = std::max(sharpest, std::abs(now_change - change) / kCycleS);
    at = now_at;
    speed = now_speed;
    change = now_change;
    return rig.core.next_result().has_value();
  });
  EXPECT_LE(fastest, kSpeed * 1.001);
  EXPECT_GT(fastest, kSpeed * 0.95);
  // A packet has six decimals of a degree.
  EXPECT_LE(hardest, kAcceleration * 1.02);
  EXPECT_GT(hardest, kAcceleration * 0.9);
  EXPECT_LE(sharpest, kJerk * 1.7) << "rounding included";
}

TEST(RsiPositionerMoves, GoOnFromWhereItStandsInAnotherSession) {
  TableRig rig;
  ASSERT_EQ(rig.move(MoveKind::kTransit, rig.turned_by(20, 70)).outcome, MoveOutcome::kArrived);
  rig.krc.cancel_program();
  rig.run(2s);
  EXPECT_NE(rig.core.state().link, RobotLink::kReady);
  rig.make_ready();
  EXPECT_NEAR(rig.krc.correction_deg()[kTurn], 0.0, 1e-3) << "RSI_ON is where it stands";
  const CoreResult result = rig.move(MoveKind::kTransit, rig.turned_by(-10, -5));
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived) << words(result);
  EXPECT_NEAR(rig.actual_deg(kTilt), 15.0, 0.01);
  EXPECT_NEAR(rig.actual_deg(kTurn), 45.0, 0.01);
}

TEST(RsiPositionerLimits, AreCheckedBeforeAnythingMoves) {
  TableRig rig;
  const CoreResult refused = rig.move(MoveKind::kTransit, rig.turned_by(60, 0));
  EXPECT_EQ(refused.outcome, MoveOutcome::kRefused);
  expect_cause(refused.cause, cause::AboveLimit{WireAxis(6), 65.0, 60.0}, 0.01);
  EXPECT_EQ(rig.krc.correction_deg()[kTilt], 0.0);
  RsiConfig narrow = with_table();
  narrow.correction_limit_deg[kTurn] = 50.0;
  Rig other(controller_with_table(), narrow);
  other.make_ready();
  const CoreResult beyond = other.move(MoveKind::kTransit, other.moved_by(kTurn, 50.5));
  EXPECT_EQ(beyond.outcome, MoveOutcome::kRefused);
  expect_cause(beyond.cause, cause::CorrectionLimit{WireAxis(7), 50.5, 50.0}, 0.01);
}

TEST(RsiPositionerMoves, AreNoPartOfASearchNorOfTheWayOutOfAContact) {
  TableRig rig;
  for (const MoveKind kind : {MoveKind::kSearch, MoveKind::kRetreat}) {
    rig.guard.arm(kArm);
    const CoreResult result = rig.move(kind, rig.turned_by(0, 1), 5.0, kArm);
    EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
    ASSERT_TRUE(is<cause::TravelAtTarget>(result.cause)) << words(result);
    EXPECT_EQ(std::get<cause::TravelAtTarget>(result.cause).axis.place, kTurn);
  }
  EXPECT_EQ(rig.krc.correction_deg()[kTurn], 0.0);
}

TEST(RsiPositionerMoves, StopWithinTheirLimitsWhenToldTo) {
  TableRig rig;
  rig.begin(MoveKind::kTransit, rig.turned_by(0, 150));
  rig.run(2s);
  rig.core.stop();
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kStopped) << words(result);
  const double stopped = rig.actual_deg(kTurn);
  EXPECT_GT(stopped, 0.0);
  EXPECT_LT(stopped, 100.0);
  rig.run(500ms);
  EXPECT_NEAR(rig.actual_deg(kTurn), stopped, 1e-3);
}

TEST(RsiPositionerMoves, EndByTheAxisNameWhereItDoesNotFollow) {
  TableRig rig;
  rig.begin(MoveKind::kTransit, rig.turned_by(0, 90));
  rig.run(600ms);
  rig.krc.slide(kTurn, 0.0);  // its brake is closed
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing);
  ASSERT_TRUE(is<cause::AxisStands>(result.cause)) << words(result);
  EXPECT_EQ(std::get<cause::AxisStands>(result.cause).axis.place, kTurn);
  EXPECT_EQ(rig.core.state().link, RobotLink::kNotReferenced);
}

/// In each kind of move of the arm alone, identified by name; nothing continues before a reference.
TEST(RsiPositionerThatMovesUnasked, StopsTheArm) {
  for (const MoveKind kind : {MoveKind::kTransit, MoveKind::kSearch}) {
    TableRig rig;
    rig.guard.arm(kArm);
    rig.begin(kind, rig.moved_by(0, 40), 20.0, kArm);
    rig.run(1s);
    rig.krc.slide(kTilt, 0.2);  // 0.05 deg within 4.4 ms
    rig.cycle();
    rig.cycle();
    rig.cycle();
    const double asked = rig.krc.setpoint_rad()[0];
    const CoreResult result = rig.finish();
    EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing);
    ASSERT_TRUE(is<cause::MovedUnasked>(result.cause)) << words(result);
    EXPECT_EQ(std::get<cause::MovedUnasked>(result.cause).axis.place, kTilt);
    EXPECT_FALSE(std::get<cause::MovedUnasked>(result.cause).axis.linear);
    EXPECT_NEAR(rig.krc.setpoint_rad()[0], asked, 2 * kDeg);
    const CoreResult next = rig.move(MoveKind::kTransit, rig.moved_by(0, 1));
    EXPECT_EQ(next.outcome, MoveOutcome::kRefused);
    EXPECT_TRUE(is<cause::MovedUnasked>(next.cause)) << words(next);
    rig.krc.slide(kTilt, std::nullopt);
    rig.run(500ms);
    rig.make_referenced();
    EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kArrived);
  }
}

TEST(RsiPositionerThatMovesUnasked, WhileItsOtherAxisTurnsStopsBoth) {
  TableRig rig;
  rig.begin(MoveKind::kTransit, rig.turned_by(0, 120));
  rig.run(1s);
  rig.krc.slide(kTilt, 0.2);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing);
  ASSERT_TRUE(is<cause::MovedUnasked>(result.cause)) << words(result);
  EXPECT_EQ(std::get<cause::MovedUnasked>(result.cause).axis.place, kTilt);
  const double stopped = rig.actual_deg(kTurn);
  rig.run(200ms);
  EXPECT_NEAR(rig.actual_deg(kTurn), stopped, 1e-3);
}

TEST(RsiPositionerThatMovesUnasked, BetweenMovesForbidsTheNextUntilAReference) {
  TableRig rig;
  rig.krc.slide(kTurn, 0.2);
  rig.run(500ms);
  const CoreResult result = rig.move(MoveKind::kTransit, rig.moved_by(0, 1));
  EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
  ASSERT_TRUE(is<cause::MovedUnasked>(result.cause)) << words(result);
  EXPECT_EQ(std::get<cause::MovedUnasked>(result.cause).axis.place, kTurn);
}

TEST(RsiPositionerBehindALinearUnit, FollowsItAsE2) {
  RsiConfig config = with_table();
  config.limits.insert(config.limits.begin(), {0.0, 3.0, 1.0, 0.5, 5.0, true});
  config.correction_limit_deg.insert(config.correction_limit_deg.begin(), 3001.0);
  sim::ControllerConfig controller = controller_with_table();
  controller.linear_unit = true;
  controller.start_rad.insert(controller.start_rad.begin(), 1.2);
  controller.clamp_external = controller.monitor_external = {3001.0, 121.0, 371.0, 0.0};
  Rig rig(controller, config);
  rig.make_ready();
  AxisAngles target = rig.commanded();
  target[kTilt + 1] += 25 * kDeg;
  const CoreResult result = rig.move(MoveKind::kTransit, target);
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived) << words(result);
  EXPECT_NEAR(rig.krc.correction_deg()[6], 0.0, 0.1) << "E1, mm";
  EXPECT_NEAR(rig.krc.correction_deg()[7], 25.0, 0.01) << "E2";
  EXPECT_NEAR(rig.krc.correction_deg()[8], 0.0, 0.01) << "E3";
}

TEST(RsiPositionerWithoutEIPos, HasNoReference) {
  Rig rig({}, with_table());
  rig.krc.rsi_on();
  rig.run(500ms);
  EXPECT_EQ(rig.core.state().link, RobotLink::kDown);
}

}  // namespace
}  // namespace cellcal::drivers
