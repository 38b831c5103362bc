// The EKI adapter's mover by itself, state by state: what it asks of the controller, what each end
// is called, and with which figures.

#include "drivers/kuka/eki/eki_mover.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/drivers/kuka/expect_cause.h"
#include "tests/drivers/kuka/rsi/scripted_guard.h"

namespace cellcal::drivers {
namespace {

using namespace std::chrono_literals;
constexpr double kDeg = std::numbers::pi / 180.0;

struct EkiMoverAlone : testing::Test {
  EkiMoverAlone() {
    config.limits.assign(2, {-9, 9, 100 * kDeg, 0, 0});
    config.full_speed_rad_s = {200 * kDeg, 400 * kDeg};
    at_deg = {10.0, -20.0};
    for (int i = 0; i < 20; ++i) state();
  }

  AxisAngles at_rad() const { return {at_deg[0] * kDeg, at_deg[1] * kDeg}; }
  /// Of A2, by so much.
  std::optional<CoreResult> begin(MoveKind kind, double by_deg, double cruise_s = 0.0,
                                  std::uint16_t arm_id = 0) {
    target_deg = {at_deg[0], at_deg[1] + by_deg};
    mover.listen(now);
    auto refused =
        mover.start({++id, kind, {target_deg[0] * kDeg, target_deg[1] * kDeg}, cruise_s, arm_id},
                    at_rad(), now);
    if (!refused) mover.sent(++command);
    return refused;
  }
  void search() {
    guard.disarm();  // the arming before is over, and its number may be used again
    mover.listen(now);
    guard.arm(5);
    ASSERT_FALSE(begin(MoveKind::kSearch, 5.0, 10.0, 5));
    moving();
  }
  std::optional<CoreResult> tick(Duration d = 4ms) {
    now += d;
    mover.listen(now);
    return mover.on_tick(now);
  }
  /// 20 ms later: a state of the controller.
  std::optional<CoreResult> state(EkiProgress progress = EkiProgress::kIdle,
                                  EkiOutcome outcome = EkiOutcome::kNone) {
    for (int i = 0; i < 5; ++i) {
      if (auto result = tick()) return result;
    }
    time_ms += 20;
    record.push(now, time_ms, at_rad(), at_rad());
    frame.axes_deg = at_deg;
    frame.move_id = command;
    frame.progress = progress;
    frame.outcome = outcome;
    return mover.on_state(frame, now);
  }
  void moving(int count = 1, double each_deg = 0.01) {
    for (int i = 0; i < count; ++i) {
      at_deg[1] += each_deg;
      ASSERT_FALSE(state(EkiProgress::kMoving));
    }
  }
  /// Says that it is done until the mover says so, too.
  CoreResult done(EkiOutcome outcome, int limit = 300) {
    for (states = 1; states <= limit; ++states) {
      if (const auto result = state(EkiProgress::kDone, outcome)) {
        EXPECT_EQ(result->id, id);
        EXPECT_FALSE(mover.busy());
        return *result;
      }
    }
    ADD_FAILURE() << "no result";
    return {};
  }
  void arrive() { at_deg = target_deg; }

  void expect(const CoreResult& result, MoveOutcome outcome, const Cause& cause,
              double within = 1e-6) {
    EXPECT_EQ(result.outcome, outcome) << to_string(result.outcome);
    expect_cause(result.cause, cause, within);
    EXPECT_EQ(result.latch.has_value(), outcome == MoveOutcome::kContact);
  }

  EkiConfig config;
  ScriptedGuard guard;
  PositionRecord record;
  EkiMover mover{config, &guard, record};
  TimePoint now{1000s};
  AxisAngles at_deg, target_deg;
  EkiState frame;
  std::uint32_t id = 0, command = 0, time_ms = 0;
  int states = 0;
};

// ---- what is asked -----------------------------------------------------------------------------

TEST_F(EkiMoverAlone, ATransitIsPtpAtTheLimitsUnderTheInput) {
  ASSERT_FALSE(begin(MoveKind::kTransit, 30.0));
  const EkiCommand& asked = mover.command();
  EXPECT_EQ(asked.type, EkiType::kMove);
  EXPECT_EQ(asked.path, EkiPath::kPtp);
  EXPECT_EQ(asked.guard, EkiGuard::kInput);
  EXPECT_EQ(asked.percent, config.transit_percent());
  EXPECT_EQ(asked.percent, 25);  // A2: 100 of 400 deg/s
  ASSERT_EQ(asked.target_deg.size(), 2u);
  EXPECT_NEAR(asked.target_deg[0], 10.0, 1e-9);
  EXPECT_NEAR(asked.target_deg[1], 10.0, 1e-9);
  EXPECT_EQ(asked.id, command);
}

TEST_F(EkiMoverAlone, AskedForSlowlyItIsSlowerNeverFasterAndNeverNought) {
  // 30 deg in 2 s are 15 of 400 deg/s: 3 percent.
  ASSERT_FALSE(begin(MoveKind::kTransit, 30.0, 2.0));
  EXPECT_EQ(mover.command().path, EkiPath::kPtp);
  EXPECT_EQ(mover.command().percent, 3);
  mover.abandon(cause::Silence{0.0});
  ASSERT_FALSE(begin(MoveKind::kTransit, 30.0, 0.01));
  EXPECT_EQ(mover.command().percent, 25);
  mover.abandon(cause::Silence{0.0});
  ASSERT_FALSE(begin(MoveKind::kTransit, 1.0, 60.0));
  EXPECT_EQ(mover.command().percent, 1);
}

TEST_F(EkiMoverAlone, ASearchAndAShortRetreatAreStraightAndALongRetreatIsNot) {
  guard.arm(5);
  ASSERT_FALSE(begin(MoveKind::kSearch, 12.0, 10.0, 5));
  EXPECT_EQ(mover.command().path, EkiPath::kLin);
  EXPECT_EQ(mover.command().duration_s, 10.0);
  EXPECT_EQ(mover.command().guard, EkiGuard::kInput);
  mover.abandon(cause::Silence{0.0});
  ASSERT_FALSE(begin(MoveKind::kRetreat, -9.9, 10.0));
  EXPECT_EQ(mover.command().path, EkiPath::kLin);
  EXPECT_EQ(mover.command().guard, EkiGuard::kNone);
  mover.abandon(cause::Silence{0.0});
  ASSERT_FALSE(begin(MoveKind::kRetreat, -10.1, 2.0));
  EXPECT_EQ(mover.command().path, EkiPath::kPtp);
  EXPECT_EQ(mover.command().percent, 1);
  mover.abandon(cause::Silence{0.0});
  // The limits make it slower: 5 deg at 100 deg/s.
  ASSERT_FALSE(begin(MoveKind::kRetreat, -5.0, 0.01));
  EXPECT_NEAR(mover.command().duration_s, 0.05, 1e-9);
}

TEST_F(EkiMoverAlone, WithoutTheInputNothingIsGuardedByItAndFastSearchesAreRefused) {
  config.stop = EkiStop::kFlag;
  guard.arm(5);
  const auto refused = begin(MoveKind::kSearch, 5.0, 4.0, 5);
  ASSERT_TRUE(refused);
  expect(*refused, MoveOutcome::kRefused, cause::TooFastForFlag{1, 1.25, 1.0});
  EXPECT_EQ(refused->at_rad, at_rad());
  const auto without_a_time = begin(MoveKind::kSearch, 5.0, 0.0, 5);
  ASSERT_TRUE(without_a_time);
  expect(*without_a_time, MoveOutcome::kRefused, cause::TooFastForFlag{0, 100.0, 1.0});
  EXPECT_FALSE(begin(MoveKind::kSearch, 5.0, 5.01, 5));
  EXPECT_EQ(mover.command().guard, EkiGuard::kNone);
  mover.abandon(cause::Silence{0.0});
  EXPECT_FALSE(begin(MoveKind::kRetreat, 5.0, 4.0)) << "only searches have a latch";
}

TEST_F(EkiMoverAlone, WhatTheSensorIsInTheWayOfIsNoAxissFault) {
  guard.arm(6);
  const auto refused = begin(MoveKind::kSearch, 5.0, 10.0, 5);
  ASSERT_TRUE(refused);
  expect(*refused, MoveOutcome::kRefused, cause::ArmedOtherwise{5, 6});
}

// ---- how it ends -------------------------------------------------------------------------------

TEST_F(EkiMoverAlone, EachMoveArrivesAtRestAfterTwoWindowsOfStates) {
  for (int move = 0; move < 2; ++move) {
    ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
    moving(10, 0.5);
    arrive();
    const CoreResult result = done(EkiOutcome::kArrived);
    expect(result, MoveOutcome::kArrived, cause::None{});
    EXPECT_EQ(states, 10);
    EXPECT_NEAR(result.at_rad[1], target_deg[1] * kDeg, 1e-12);
  }
}

TEST_F(EkiMoverAlone, WhatTheControllerSaysAgainstItIsTheCause) {
  frame.fault = 17;
  const std::tuple<EkiOutcome, MoveOutcome, Cause> ends[] = {
      {EkiOutcome::kSoftLimit, MoveOutcome::kRefused, cause::OutsideSoftLimits{}},
      {EkiOutcome::kNotFeasible, MoveOutcome::kRefused, cause::NotFeasible{}},
      {EkiOutcome::kNone, MoveOutcome::kRefused, cause::NotFeasible{}},
      {EkiOutcome::kDeadMan, MoveOutcome::kRobotSilent, cause::DeadMan{}},
      {EkiOutcome::kAborted, MoveOutcome::kNotFollowing, cause::ProgramAborted{17}},
      {EkiOutcome::kInputAtStart, MoveOutcome::kUnexpectedContact, cause::TouchedOutsideSearch{}},
      {EkiOutcome::kInput, MoveOutcome::kUnexpectedContact, cause::TouchedOutsideSearch{}},
      {EkiOutcome::kStop, MoveOutcome::kStopped, cause::StopAsked{}}};
  for (const auto& [said, outcome, cause] : ends) {
    ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
    moving();
    expect(done(said), outcome, cause);
  }
  guard.arm(5);
  ASSERT_FALSE(begin(MoveKind::kSearch, 5.0, 10.0, 5));
  moving();
  expect(done(EkiOutcome::kInputAtStart), MoveOutcome::kRefused, cause::InputAtStart{});
  guard.arm(5);
  ASSERT_FALSE(begin(MoveKind::kSearch, 5.0, 10.0, 5));
  moving();
  expect(done(EkiOutcome::kStop), MoveOutcome::kStopped, cause::StopAsked{});
}

TEST_F(EkiMoverAlone, AnArmThatEndsElsewhereIsNamedWithBothAngles) {
  for (const double short_deg : {0.049, 0.051, -0.051}) {
    ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
    moving();
    at_deg[1] = target_deg[1] - short_deg;
    const CoreResult result = done(EkiOutcome::kArrived);
    if (std::abs(short_deg) < 0.05) {
      expect(result, MoveOutcome::kArrived, cause::None{});
    } else {
      expect(result, MoveOutcome::kNotFollowing, cause::NotAtTarget{1, target_deg[1], at_deg[1]});
    }
  }
  // And nothing of it is said of the next.
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  moving();
  arrive();
  expect(done(EkiOutcome::kArrived), MoveOutcome::kArrived, cause::None{});
}

TEST_F(EkiMoverAlone, AnArmThatNeverRestsIsNamedAfterTwoSeconds) {
  for (const double drift_deg : {0.00015, 0.0004}) {  // 0.00075 and 0.002 deg per window
    ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
    moving();
    arrive();
    std::optional<CoreResult> result;
    int count = 0;
    while (!result && count < 300) {
      at_deg[0] += drift_deg;
      ++count;
      result = state(EkiProgress::kDone, EkiOutcome::kArrived);
    }
    ASSERT_TRUE(result);
    if (drift_deg < 0.0002) {
      expect(*result, MoveOutcome::kArrived, cause::None{});
      EXPECT_EQ(count, 10);
    } else {
      expect(*result, MoveOutcome::kArrived, cause::NotSettled{0, 5 * drift_deg, 2.0}, 0.021);
      EXPECT_NEAR(std::get<cause::NotSettled>(result->cause).moved_deg, 5 * drift_deg, 1e-6);
      EXPECT_NEAR(count, 101, 1);
    }
    at_deg[0] = 10.0;
  }
}

TEST_F(EkiMoverAlone, AProgramThatForgetsTheMoveHasAbortedIt) {
  for (const bool other : {true, false}) {
    ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
    moving(3);
    frame.fault = 4;
    if (other) command += 7;
    std::optional<CoreResult> result;
    for (int i = 0; i < 20 && !result; ++i) {
      result = state(other ? EkiProgress::kMoving : EkiProgress::kIdle);
    }
    ASSERT_TRUE(result);
    expect(*result, MoveOutcome::kNotFollowing, cause::ProgramAborted{4});
  }
}

TEST_F(EkiMoverAlone, AStateOfAnotherMoveDoesNotBeginThisOne) {
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  ++command;
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(state(EkiProgress::kDone, EkiOutcome::kArrived)) << i;
  EXPECT_TRUE(mover.busy());
}

TEST_F(EkiMoverAlone, ACommandThatIsNotTakenWithinHalfASecondIsGivenUp) {
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  const TimePoint asked = now;
  while (now - asked < 500ms) ASSERT_FALSE(tick());
  const auto result = tick();
  ASSERT_TRUE(result);
  expect(*result, MoveOutcome::kRobotSilent, cause::CommandNotTaken{0.504});
  EXPECT_EQ(result->at_rad, at_rad());
}

TEST_F(EkiMoverAlone, AStopIsAskedForOnceAndGivenUpAfterTwoSeconds) {
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  moving(3);
  EXPECT_FALSE(mover.wants_stop());
  mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  mover.halt(MoveOutcome::kContactSilent, cause::SensorDead{});
  EXPECT_TRUE(mover.wants_stop());
  mover.stop_sent(now);
  EXPECT_FALSE(mover.wants_stop());
  const TimePoint sent = now;
  while (now - sent < 2000ms) ASSERT_FALSE(tick());
  const auto result = tick();
  ASSERT_TRUE(result);
  expect(*result, MoveOutcome::kRobotSilent, cause::CommandNotTaken{2.004});
}

TEST_F(EkiMoverAlone, AStopThatIsTakenEndsAsItWasAsked) {
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  moving(3);
  mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  mover.stop_sent(now);
  expect(done(EkiOutcome::kStop), MoveOutcome::kStopped, cause::StopAsked{});
  mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  EXPECT_FALSE(mover.busy() || mover.wants_stop());
}

TEST_F(EkiMoverAlone, CancelledBeforeItWasSentItSaysWhy) {
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  const CoreResult stopped = *mover.cancel(TimePoint{});
  expect(stopped, MoveOutcome::kStopped, cause::StopAsked{});
  EXPECT_EQ(stopped.at_rad, at_rad());
  guard.arm(5);
  ASSERT_FALSE(begin(MoveKind::kSearch, 5.0, 10.0, 5));
  expect(*mover.cancel(TimePoint{}), MoveOutcome::kRefused, cause::TrippedAtStart{});
}

TEST_F(EkiMoverAlone, StoppedAtAWayPointBeforeTheNextLegWasSentItOnlyComesToRest) {
  mover.listen(now);
  ASSERT_FALSE(mover.start({++id,
                            MoveKind::kTransit,
                            {10.0 * kDeg, 0.0},
                            0.0,
                            0,
                            {{{10.0 * kDeg, -10.0 * kDeg}, 0.5, 0.5}}},
                           at_rad(), now));
  EXPECT_TRUE(mover.wants_sending());
  EXPECT_NEAR(mover.command().target_deg[1], -10.0, 1e-9);
  mover.sent(++command);
  EXPECT_FALSE(mover.wants_sending());
  moving(3);
  at_deg[1] = -10.0;
  ASSERT_FALSE(state(EkiProgress::kDone, EkiOutcome::kArrived));
  ASSERT_TRUE(mover.wants_sending()) << "the next leg";
  EXPECT_NEAR(mover.command().target_deg[1], 0.0, 1e-9);
  mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  ASSERT_TRUE(mover.wants_stop());
  EXPECT_FALSE(mover.cancel(now)) << "it settles first";
  EXPECT_FALSE(mover.wants_stop() || mover.wants_sending());
  const CoreResult stopped = done(EkiOutcome::kArrived);
  expect(stopped, MoveOutcome::kStopped, cause::StopAsked{});
  EXPECT_NEAR(stopped.at_rad[1], -10.0 * kDeg, 1e-9);
}

TEST_F(EkiMoverAlone, AnArmThatDoesNotMoveForTwoSecondsIsNamedWithTheOverride) {
  frame.override_percent = 3;
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  moving();
  const TimePoint stood = now;
  while (now - stood < 1990ms) {
    at_deg[1] += 1e-5;  // less than 0.002 deg in all
    ASSERT_FALSE(state(EkiProgress::kMoving));
    ASSERT_FALSE(mover.wants_stop());
  }
  ASSERT_FALSE(state(EkiProgress::kMoving));
  EXPECT_TRUE(mover.wants_stop());
  mover.stop_sent(now);
  expect(done(EkiOutcome::kStop), MoveOutcome::kNotFollowing, cause::NotMoving{2.02, 3}, 0.021);
}

TEST_F(EkiMoverAlone, AnArmThatCreepsIsNotStanding) {
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  moving(200, 0.00021);  // more than 0.002 deg in ten states
  EXPECT_FALSE(mover.wants_stop());
}

// ---- the sensor --------------------------------------------------------------------------------

TEST_F(EkiMoverAlone, ContactOutsideOfASearchAndASensorThatDiesAskForAStop) {
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  moving(3);
  guard.touch(true);
  EXPECT_FALSE(tick());
  EXPECT_TRUE(mover.wants_stop());
  mover.stop_sent(now);
  expect(done(EkiOutcome::kStop), MoveOutcome::kUnexpectedContact, cause::TouchedOutsideSearch{});
  guard.touch(false);
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  moving(3);
  guard.set_alive(false);
  EXPECT_FALSE(tick());
  guard.set_alive(true);
  EXPECT_TRUE(mover.wants_stop());
  expect(done(EkiOutcome::kStop), MoveOutcome::kContactSilent, cause::SensorDead{});
}

TEST_F(EkiMoverAlone, ARetreatThatEndsInContactSaysSo) {
  for (const bool open : {true, false}) {
    guard.touch(true);
    ASSERT_FALSE(begin(MoveKind::kRetreat, -1.0, 1.0));
    moving(3, -0.1);
    if (open) guard.touch(false);
    arrive();
    const CoreResult result = done(EkiOutcome::kArrived);
    if (open) expect(result, MoveOutcome::kArrived, cause::None{});
    if (!open) expect(result, MoveOutcome::kStillInContact, cause::ContactNotOpen{});
  }
}

TEST_F(EkiMoverAlone, ARetreatThatIsStoppedIsStoppedThoughItStillTouches) {
  guard.touch(true);
  ASSERT_FALSE(begin(MoveKind::kRetreat, -1.0, 1.0));
  moving(3, -0.1);
  mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  mover.stop_sent(now);
  expect(done(EkiOutcome::kStop), MoveOutcome::kStopped, cause::StopAsked{});
}

struct EkiMoverSearch : EkiMoverAlone {
  /// The controller's interrupt has latched where the arm was then.
  void latched(double a2_deg) {
    frame.latch_id = command;
    frame.latch_deg = {at_deg[0], a2_deg};
  }
};

TEST_F(EkiMoverSearch, LatchesWhereTheControllersInterruptSawIt) {
  search();
  moving(20, 0.01);  // 0.5 deg/s
  const TimePoint edge = now - 4ms;
  guard.trip(5, edge);
  EXPECT_FALSE(tick());
  EXPECT_FALSE(mover.wants_stop()) << "the input has its chance first";
  guard.push(ContactEventKind::kContact, 5, edge, 4);
  latched(at_deg[1] - 0.003);
  const CoreResult result = done(EkiOutcome::kInput);
  expect(result, MoveOutcome::kContact, cause::None{});
  EXPECT_NEAR(result.latch->contact_rad[1], (at_deg[1] - 0.003) * kDeg, 1e-9);
  EXPECT_NEAR(result.latch->settled_rad[1], at_deg[1] * kDeg, 1e-9);
  EXPECT_EQ(result.latch->contact_time, edge);
  EXPECT_EQ(result.latch->time_sigma_s, config.latch_jitter_s);
  EXPECT_EQ(result.latch->bounces, 4);
  EXPECT_NEAR(result.latch->reaction_s, 0.028, 1e-9);
  // The next search has none of it.
  guard.arm(5);
  ASSERT_FALSE(begin(MoveKind::kSearch, 5.0, 10.0, 5));
  moving(3);
  arrive();
  expect(done(EkiOutcome::kArrived), MoveOutcome::kArrived, cause::None{});
}

TEST_F(EkiMoverSearch, TheInputHasFortyMillisecondsBeforeTheNetworkStopsIt) {
  search();
  moving(3);
  guard.push(ContactEventKind::kTrip, 5, now);
  EXPECT_FALSE(tick());
  const TimePoint heard = now;
  while (now - heard < 40ms) {
    EXPECT_FALSE(mover.wants_stop());
    EXPECT_FALSE(tick());
  }
  EXPECT_FALSE(mover.wants_stop());
  EXPECT_FALSE(tick(500us));
  EXPECT_TRUE(mover.wants_stop());
  mover.stop_sent(now);
  guard.push(ContactEventKind::kContact, 5, heard);
  expect(done(EkiOutcome::kStop), MoveOutcome::kContactSilent, cause::InputMissed{});
}

TEST_F(EkiMoverSearch, NoiseStopsItAtOnceAndIsRevoked) {
  search();
  moving(3);
  guard.push(ContactEventKind::kRevoked, 5, now);
  EXPECT_FALSE(tick());
  EXPECT_TRUE(mover.wants_stop());
  mover.stop_sent(now);
  expect(done(EkiOutcome::kStop), MoveOutcome::kRevoked, cause::None{});
  search();  // of which the sensor says nothing
  moving(3);
  expect(done(EkiOutcome::kInput), MoveOutcome::kContactSilent, cause::InputAlone{0.104});
}

TEST_F(EkiMoverSearch, ByFlagATripStopsItAtOnce) {
  config.stop = EkiStop::kFlag;
  search();
  moving(20, 0.01);
  const TimePoint edge = now - 3ms;
  guard.trip(5, edge);
  EXPECT_FALSE(tick());
  EXPECT_TRUE(mover.wants_stop());
  mover.stop_sent(now);
  guard.push(ContactEventKind::kContact, 5, edge);
  const CoreResult result = done(EkiOutcome::kStop);
  expect(result, MoveOutcome::kContact, cause::None{});
  EXPECT_NEAR(result.latch->contact_rad[1], (at_deg[1] - 0.0015) * kDeg, 1e-9);
  EXPECT_NEAR(result.latch->time_sigma_s, std::hypot(20e-6, config.flag_sigma_s), 1e-12);
}

TEST_F(EkiMoverSearch, ASensorThatDiesOrLetsGoAsksForAStop) {
  search();
  moving(3);
  guard.set_alive(false);
  EXPECT_FALSE(tick());
  guard.set_alive(true);
  EXPECT_TRUE(mover.wants_stop());
  mover.stop_sent(now);
  expect(done(EkiOutcome::kStop), MoveOutcome::kContactSilent, cause::SensorDead{});
  search();
  moving(3);
  guard.disarm();
  EXPECT_FALSE(tick());
  EXPECT_TRUE(mover.wants_stop());
  expect(done(EkiOutcome::kStop), MoveOutcome::kContactSilent, cause::ArmExpired{});
  search();
  moving(3);
  guard.arm(6);
  EXPECT_FALSE(tick());
  EXPECT_TRUE(mover.wants_stop());
  expect(done(EkiOutcome::kStop), MoveOutcome::kContactSilent, cause::ArmExpired{});
}

TEST_F(EkiMoverSearch, BehindItsArrivalTheSensorIsStillListenedTo) {
  const auto arrived = [&] {
    search();
    moving(3);
    arrive();
    EXPECT_FALSE(state(EkiProgress::kDone, EkiOutcome::kArrived));
  };
  arrived();
  guard.set_alive(false);
  EXPECT_FALSE(tick());
  guard.set_alive(true);
  expect(done(EkiOutcome::kArrived), MoveOutcome::kContactSilent, cause::SensorDead{});
  arrived();
  guard.disarm();
  EXPECT_FALSE(tick());
  expect(done(EkiOutcome::kArrived), MoveOutcome::kContactSilent, cause::ArmExpired{});
  arrived();
  guard.arm(9);
  EXPECT_FALSE(tick());
  expect(done(EkiOutcome::kArrived), MoveOutcome::kContactSilent, cause::ArmExpired{});
  arrived();
  guard.push(ContactEventKind::kTrip, 5, now);
  EXPECT_FALSE(tick());
  guard.push(ContactEventKind::kRevoked, 5, now);
  expect(done(EkiOutcome::kArrived), MoveOutcome::kRevoked, cause::None{});
}

TEST_F(EkiMoverSearch, AnInputOrATripWithoutTheSensorsWordIsSilenceAfterATenth) {
  search();
  moving(3);
  expect(done(EkiOutcome::kInput), MoveOutcome::kContactSilent, cause::InputAlone{0.104});
  search();
  moving(3);
  guard.push(ContactEventKind::kTrip, 5, now);
  EXPECT_FALSE(tick());
  // Counted from the end of the motion, and told from the trip.
  expect(done(EkiOutcome::kInput), MoveOutcome::kContactSilent, cause::TripUnconfirmed{0.124},
         1e-6);
  search();
  moving(3);
  EXPECT_FALSE(state(EkiProgress::kDone, EkiOutcome::kInput));
  guard.set_alive(false);
  EXPECT_FALSE(tick());
  guard.set_alive(true);
  expect(done(EkiOutcome::kInput), MoveOutcome::kContactSilent, cause::SensorDead{});
}

TEST_F(EkiMoverSearch, ALatchOfAnotherMoveIsNone) {
  search();
  moving(20, 0.01);
  guard.push(ContactEventKind::kContact, 5, now - 4ms);
  latched(at_deg[1]);
  frame.latch_id = command - 1;
  expect(done(EkiOutcome::kInput), MoveOutcome::kContactSilent, cause::LatchMissing{});
  search();
  moving(20, 0.01);
  guard.push(ContactEventKind::kContact, 5, now - 4ms);
  latched(at_deg[1]);
  frame.latch_deg = {at_deg[0]};
  expect(done(EkiOutcome::kInput), MoveOutcome::kContactSilent, cause::LatchMissing{});
}

TEST_F(EkiMoverSearch, ALatchBesideThePathIsNamedWithBothAngles) {
  // 0.02 deg and 0.06 s of the search's speed, 0.5 deg/s.
  for (const double beside_deg : {0.047, 0.053, -0.053}) {
    search();
    moving(20, 0.01);
    const double path_deg = at_deg[1] - 0.002;
    guard.push(ContactEventKind::kContact, 5, now - 4ms);
    latched(path_deg + beside_deg);
    const CoreResult result = done(EkiOutcome::kInput);
    if (std::abs(beside_deg) < 0.05) {
      expect(result, MoveOutcome::kContact, cause::None{});
    } else {
      expect(result, MoveOutcome::kContactSilent,
             cause::LatchAstray{1, path_deg + beside_deg, path_deg}, 1e-4);
    }
  }
}

TEST_F(EkiMoverAlone, AbandonedItSaysWhereTheArmWasSeenLast) {
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  moving(3);
  const CoreResult result = mover.abandon(cause::NotConnected{0.3});
  expect(result, MoveOutcome::kRobotSilent, cause::NotConnected{0.3});
  EXPECT_EQ(result.at_rad, at_rad());
  EXPECT_FALSE(mover.busy());
  PositionRecord empty;
  EkiMover blind(config, nullptr, empty);
  ASSERT_FALSE(blind.start({3, MoveKind::kTransit, at_rad(), 0.0, 0}, at_rad(), now));
  EXPECT_EQ(blind.abandon(cause::NotConnected{0.3}).at_rad, AxisAngles{});
}

}  // namespace
}  // namespace cellcal::drivers
