// An arm on a linear unit, an arm with a positioner, and external axes that no move uses; on the linear unit
// E2 is such an axis.

#include <cmath>

#include "drivers/error.h"
#include "tests/drivers/kuka/eki/eki_rig.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

constexpr std::size_t kE1 = 0, kA1 = 1, kE2 = 7;
constexpr double kE2Deg = 12.5;
/// Rounding of a controller's REAL, 32 bits, in radians and metres.
constexpr double kReal = 1e-7;

EkiConfig on_track(int external_axes = 2) {
  EkiConfig config = eki_config();
  config.external_axes = external_axes;
  config.limits.insert(config.limits.begin(), {0.0, 3.0, 1.0, 0, 0, true});
  config.full_speed_rad_s.insert(config.full_speed_rad_s.begin(), 2.0);
  return config;
}

sim::EkiControllerConfig controller_on_track() {
  sim::EkiControllerConfig config = eki_controller();
  EkiFilesConfig files;
  files.external_axes = 2;
  config.files = eki_files(files);
  config.linear_unit = true;
  config.start_rad.insert(config.start_rad.begin(), 1.2);
  config.start_rad.push_back(kE2Deg * kEkiDeg);
  config.max_speed_rad_s.assign(8, 200 * kEkiDeg);
  config.max_speed_rad_s[kE1] = 2.0;
  config.noise_sigma_deg = 0.0005;
  return config;
}

struct TrackRig : EkiRig {
  TrackRig() : EkiRig(controller_on_track(), on_track()) { make_ready(); }

  double e1_m() const { return krc.actual_rad_at(now)[kE1]; }
  double e2_deg() const { return krc.actual_rad_at(now)[kE2] / kEkiDeg; }
  AxisAngles travelled_by(double m) const {
    AxisAngles target = actual();
    target[kE1] += m;
    return target;
  }
};

TEST(EkiLinearUnit, IsTheFirstAxisInMetresAndE1InMillimetresOnTheWire) {
  TrackRig rig;
  ASSERT_EQ(rig.actual().size(), 7u);
  EXPECT_TRUE(rig.core.state().linear_unit);
  EXPECT_NEAR(rig.actual()[kE1], 1.2, 1e-4);
  EXPECT_NEAR(rig.actual()[kA1 + 1], -90 * kEkiDeg, 1e-4);
  AxisAngles target = rig.actual();
  target[kE1] = 0.85;
  target[kA1] += 10 * kEkiDeg;
  const CoreResult result = rig.move(MoveKind::kTransit, target);
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived) << words(result);
  EXPECT_NEAR(rig.e1_m(), 0.85, 1e-5);
  EXPECT_NEAR(rig.true_deg(kA1), 10.0, 1e-2);
  EXPECT_NE(rig.written.find("E1=\"850.000000\""), std::string::npos);
}

TEST(EkiLinearUnit, IsNoFasterThanItsLimit) {
  TrackRig rig;
  double fastest_m_s = 0.0, last = rig.e1_m();
  rig.begin(MoveKind::kTransit, rig.travelled_by(1.5));
  rig.run_until([&] {
    fastest_m_s = std::max(fastest_m_s, (rig.e1_m() - last) / 0.004);
    last = rig.e1_m();
    return rig.core.next_result().has_value();
  });
  EXPECT_LE(fastest_m_s, 1.001);
  EXPECT_GT(fastest_m_s, 0.8);
}

TEST(EkiLinearUnit, TurnsBackAtAWayPointWhileItLags) {
  TrackRig rig;
  Move move{++rig.last_id, MoveKind::kTransit, rig.travelled_by(0.0), 0.0, 0};
  move.via.push_back({rig.travelled_by(0.5), 0.0, 0.0});
  AxisAngles stands = rig.travelled_by(0.5);
  stands[kA1] += 5 * kEkiDeg;
  move.via.push_back({stands, 0.0, 0.0});
  rig.core.begin(move);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived) << words(result);
}

TEST(EkiLinearUnit, IsCheckedInMillimetresBeforeAnythingMoves) {
  TrackRig rig;
  AxisAngles beyond = rig.actual();
  beyond[kE1] = 3.001;
  const CoreResult result = rig.move(MoveKind::kTransit, beyond);
  EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
  expect_cause(result.cause, cause::AboveLimit{WireAxis(6, true), 3001.0, 3000.0});
  EXPECT_NE(said(words(result)).find("E1: target 3001.0000 mm"), std::string::npos)
      << words(result);
  beyond[kE1] = -0.002;
  expect_cause(rig.move(MoveKind::kTransit, beyond).cause,
               cause::BelowLimit{WireAxis(6, true), -2.0, 0.0});
  EXPECT_EQ(rig.written.find("Type=\"3\""), std::string::npos);
}

TEST(EkiLinearUnit, DoesNotTravelInASearchNorOnTheWayOutOfAContact) {
  TrackRig rig;
  for (const MoveKind kind : {MoveKind::kSearch, MoveKind::kRetreat}) {
    rig.guard.arm(++rig.arm_id);
    const CoreResult result = rig.move(kind, rig.travelled_by(0.01), 5.0, rig.arm_id);
    EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
    ASSERT_TRUE(is<cause::TravelAtTarget>(result.cause)) << words(result);
  }
  EXPECT_EQ(rig.written.find("Type=\"3\""), std::string::npos);
}

TEST(EkiLinearUnit, StandsInASearchAndIsLatchedWithTheTouch) {
  TrackRig rig;
  rig.move(MoveKind::kTransit, rig.travelled_by(0.4));
  const double stands_m = rig.e1_m();
  rig.guard.arm(++rig.arm_id);
  AxisAngles target = rig.moved_by(kA1, 2);
  target[kE1] = rig.actual()[kE1];
  rig.begin(MoveKind::kSearch, target, 4.0, rig.arm_id);
  rig.run(1s);
  ASSERT_FALSE(rig.krc.at_rest());
  const TimePoint touched = rig.now;
  rig.krc.input(touched, true);
  rig.guard.trip(rig.arm_id, touched);
  rig.guard.touch(true);
  rig.guard.push(ContactEventKind::kContact, rig.arm_id, touched);
  const CoreResult result = rig.finish();
  ASSERT_EQ(result.outcome, MoveOutcome::kContact) << words(result);
  ASSERT_EQ(result.latch->contact_rad.size(), 7u);
  EXPECT_NEAR(result.latch->contact_rad[kE1], stands_m, 5e-5);
  EXPECT_NEAR(rig.e1_m(), stands_m, kReal);
}

TEST(EkiLinearUnit, ThatMovesInASearchStopsTheArmAndNeedsANewReference) {
  TrackRig rig;
  rig.guard.arm(++rig.arm_id);
  rig.begin(MoveKind::kSearch, rig.moved_by(kA1, 5), 10.0, rig.arm_id);
  rig.run(1s);
  rig.krc.creep(kE1, 0.02);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing);
  ASSERT_TRUE(is<cause::MovedUnasked>(result.cause)) << words(result);
  EXPECT_EQ(std::get<cause::MovedUnasked>(result.cause).axis.place, 6);
  EXPECT_LT(rig.true_deg(kA1), 0.6 + 0.2) << "a second at 0.5 deg/s, and the stop";
  rig.krc.creep(kE1, 0.0);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.actual()).outcome, MoveOutcome::kRefused);
  rig.reference();
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(kA1, 1)).outcome, MoveOutcome::kArrived);
}

TEST(EkiExternalAxis, WithoutAJointIsHeldAtItsSetPointInEveryMove) {
  TrackRig rig;  // with encoder noise of 9e-6 rad
  const double set = rig.krc.setpoint_rad()[kE2];
  for (const double m : {0.3, -0.5, 0.1}) {
    ASSERT_EQ(rig.move(MoveKind::kTransit, rig.travelled_by(m)).outcome, MoveOutcome::kArrived);
    EXPECT_NEAR(rig.krc.setpoint_rad()[kE2], set, kReal);
  }
}

TEST(EkiExternalAxis, WithoutAJointThatMovesInATransitStopsTheArm) {
  TrackRig rig;
  rig.begin(MoveKind::kTransit, rig.travelled_by(1.5));
  rig.run(600ms);
  rig.krc.creep(kE2, 2 * kEkiDeg);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing);
  ASSERT_TRUE(is<cause::MovedUnasked>(result.cause)) << words(result);
  const auto moved = std::get<cause::MovedUnasked>(result.cause);
  EXPECT_EQ(moved.axis.place, 7);
  EXPECT_NEAR(moved.held_deg, kE2Deg, 0.01);
  EXPECT_LT(rig.e1_m(), 2.5) << "it was on its way to 2.7 m";
  EXPECT_NE(rig.words().find("E2"), std::string::npos) << rig.words();
}

TEST(EkiExternalAxis, ThatMovesBetweenMovesForbidsTheNextUntilAReference) {
  for (const std::size_t axis : {kE1, kE2}) {
    TrackRig rig;
    rig.krc.creep(axis, 0.05);
    rig.run(500ms);
    rig.krc.creep(axis, 0.0);
    EXPECT_EQ(rig.link(), RobotLink::kNotReferenced);
    const CoreResult result = rig.move(MoveKind::kTransit, rig.moved_by(kA1, 1));
    EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
    EXPECT_TRUE(is<cause::MovedUnasked>(result.cause)) << words(result);
    rig.reference();
    EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(kA1, 1)).outcome, MoveOutcome::kArrived);
  }
}

TEST(EkiExternalAxis, ThatCreepsBelowTheToleranceIsNotForgottenByRefusedMoves) {
  TrackRig rig;
  rig.krc.creep(kE1, 3e-4);
  for (int i = 0; i < 5; ++i) {
    rig.run(1s);
    AxisAngles beyond = rig.actual();
    beyond[kE1] = 9.0;
    rig.move(MoveKind::kTransit, beyond);
  }
  EXPECT_EQ(rig.link(), RobotLink::kNotReferenced);
  EXPECT_NE(rig.words().find("E1"), std::string::npos) << rig.words();
}

TEST(EkiExternalAxis, MissingInTheStatesIsNoReference) {
  EkiRig rig(eki_controller(), on_track());
  rig.run(40ms);
  ASSERT_TRUE(rig.connect());
  rig.run(500ms);
  EXPECT_NE(rig.link(), RobotLink::kNotReferenced);
  EXPECT_NE(rig.words().find("fewer than 8 axes"), std::string::npos) << rig.words();
}

/// Six axes, and external ones at these positions, of which the files count some.
sim::EkiControllerConfig with_external(int counted, const std::vector<double>& start_rad) {
  sim::EkiControllerConfig config = eki_controller();
  EkiFilesConfig files;
  files.external_axes = counted;
  config.files = eki_files(files);
  config.start_rad.insert(config.start_rad.end(), start_rad.begin(), start_rad.end());
  config.max_speed_rad_s.resize(config.start_rad.size(), 200 * kEkiDeg);
  return config;
}

EkiConfig counting(int external_axes) {
  EkiConfig config = eki_config();
  config.external_axes = external_axes;
  return config;
}

TEST(EkiExternalAxis, OfAnArmOfSixAxesIsHeldAndWatchedToo) {
  EkiRig rig(with_external(1, {0.7}), counting(1));
  rig.make_ready();
  EXPECT_EQ(rig.actual().size(), 6u);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 5)).outcome, MoveOutcome::kArrived);
  EXPECT_NEAR(rig.krc.setpoint_rad()[6], 0.7, kReal);
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 60));
  rig.run(400ms);
  rig.krc.creep(6, 0.1);
  EXPECT_TRUE(is<cause::MovedUnasked>(rig.finish().cause));
}

TEST(EkiExternalAxis, ThatIsNotCountedStaysWhereItIs) {
  for (const int counted : {0, 1}) {
    EkiRig rig(with_external(counted, {0.7, -0.4}), counting(counted));
    rig.make_ready();
    EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 5)).outcome, MoveOutcome::kArrived);
    EXPECT_EQ(rig.search(1, 3.0).outcome, MoveOutcome::kArrived);
    EXPECT_NEAR(rig.krc.setpoint_rad()[6], 0.7, kReal) << counted;
    EXPECT_NEAR(rig.krc.setpoint_rad()[7], -0.4, kReal) << counted;
  }
}

TEST(EkiExternalAxis, ThatTheStatesDoNotAgreeOnIsNoReference) {
  EkiRig rig(with_external(1, {0.7}), counting(1));
  rig.run(40ms);
  ASSERT_TRUE(rig.connect());
  int states = 0;
  rig.mangle = [&](std::string bytes) {
    if (const auto at = bytes.find(" E1=\""); at != std::string::npos && ++states % 2 == 0)
      bytes[at + 5] = '9';
    return bytes;
  };
  rig.run(300ms);
  rig.core.rereference();
  rig.run(1s);
  EXPECT_GT(states, 40);
  EXPECT_EQ(rig.link(), RobotLink::kNotReferenced);
  rig.mangle = [](std::string bytes) { return bytes; };
  rig.run(200ms);
  EXPECT_EQ(rig.link(), RobotLink::kReady);
}

// A positioner of two axes, E1 and E2, with a six-axis arm.
struct TableRig : EkiRig {
  TableRig() : EkiRig(controller(), config()) { make_ready(); }
  static EkiConfig config() {
    EkiConfig config = counting(2);
    for (const double limit_deg : {60.0, 185.0}) {
      const double limit = limit_deg * kEkiDeg;
      config.limits.push_back({-limit, limit, 0.5, 0, 0});
      config.full_speed_rad_s.push_back(1.0);
    }
    return config;
  }
  static sim::EkiControllerConfig controller() {
    sim::EkiControllerConfig config = with_external(2, {0.1, -0.2});
    config.noise_sigma_deg = 0.0005;
    return config;
  }
  AxisAngles turned_by(double tilt_deg, double turn_deg) const {
    AxisAngles target = actual();
    target[6] += tilt_deg * kEkiDeg;
    target[7] += turn_deg * kEkiDeg;
    return target;
  }
};

TEST(EkiPositioner, IsTurnedByTheControllerWhileTheArmRests) {
  TableRig rig;
  const double a1_deg = rig.true_deg(0);
  const AxisAngles target = rig.turned_by(20, -90);
  const CoreResult result = rig.move(MoveKind::kTransit, target);
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived) << words(result);
  EXPECT_NEAR(rig.krc.actual_rad_at(rig.now)[6], target[6], 1e-4);
  EXPECT_NEAR(rig.krc.actual_rad_at(rig.now)[7], target[7], 1e-4);
  EXPECT_NEAR(rig.true_deg(0), a1_deg, 2e-3);
}

TEST(EkiPositioner, IsCheckedAgainstItsLimitsBeforeAnythingMoves) {
  TableRig rig;
  const CoreResult result = rig.move(MoveKind::kTransit, rig.turned_by(60, 0));
  EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
  ASSERT_TRUE(is<cause::AboveLimit>(result.cause)) << words(result);
  EXPECT_NE(said(words(result)).find("E1"), std::string::npos) << words(result);
  EXPECT_EQ(rig.written.find("Type=\"3\""), std::string::npos);
}

TEST(EkiPositioner, DoesNotTurnInASearchNorOnTheWayOutOfAContact) {
  TableRig rig;
  for (const MoveKind kind : {MoveKind::kSearch, MoveKind::kRetreat}) {
    rig.guard.arm(++rig.arm_id);
    const CoreResult result = rig.move(kind, rig.turned_by(0, 1), 5.0, rig.arm_id);
    EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
    ASSERT_TRUE(is<cause::TravelAtTarget>(result.cause)) << words(result);
    EXPECT_EQ(std::get<cause::TravelAtTarget>(result.cause).axis.place, 7);
  }
}

TEST(EkiPositioner, StopsWithTheArm) {
  TableRig rig;
  rig.begin(MoveKind::kTransit, rig.turned_by(0, 90));
  rig.run(700ms);
  ASSERT_FALSE(rig.krc.at_rest());
  rig.core.stop();
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kStopped) << words(result);
  const double stopped = rig.krc.actual_rad_at(rig.now)[7];
  EXPECT_LT(stopped, 89 * kEkiDeg - 0.2);
  rig.run(1s);
  EXPECT_NEAR(rig.krc.actual_rad_at(rig.now)[7], stopped, 1e-6);
}

TEST(EkiPositioner, ThatDoesNotReachItsAngleEndsTheMoveByItsName) {
  TableRig rig;
  rig.begin(MoveKind::kTransit, rig.turned_by(0, 45));
  rig.run(400ms);
  rig.krc.creep(7, -0.1);
  rig.run(200ms);
  rig.krc.creep(7, 0.0);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing);
  ASSERT_TRUE(is<cause::NotAtTarget>(result.cause)) << words(result);
  EXPECT_EQ(std::get<cause::NotAtTarget>(result.cause).axis.place, 7);
}

TEST(EkiPositioner, ThatMovesWhileTheArmAloneIsAskedToStopsIt) {
  TableRig rig;
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 60));
  rig.run(400ms);
  rig.krc.creep(6, 0.1);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing);
  ASSERT_TRUE(is<cause::MovedUnasked>(result.cause)) << words(result);
  EXPECT_EQ(std::get<cause::MovedUnasked>(result.cause).axis.place, 6);
}

TEST(EkiLinearUnit, IsTheFirstOfSevenAxesOrMore) {
  EkiConfig config = on_track();
  EXPECT_NO_THROW(config.validate());
  std::swap(config.limits[0], config.limits[3]);
  EXPECT_THROW(config.validate(), ConfigError);
  config = on_track();
  config.limits.pop_back();
  config.full_speed_rad_s.pop_back();
  EXPECT_THROW(config.validate(), ConfigError);
}

}  // namespace
}  // namespace cellcal::drivers
