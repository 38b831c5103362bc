// The EKI adapter's mover by itself, state by state: what it asks of the controller, what each end
// is called, and with which figures.

#include "drivers/kuka/eki/eki_mover.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

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

  void expect(const CoreResult& result, MoveOutcome outcome, Cause cause, int axis = 0,
              double a = 0.0, double b = 0.0, double within = 1e-6) {
    EXPECT_EQ(result.outcome, outcome) << to_string(result.outcome);
    EXPECT_EQ(result.cause, cause);
    EXPECT_EQ(result.axis, axis);
    EXPECT_NEAR(result.a, a, within);
    EXPECT_NEAR(result.b, b, within);
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
  mover.abandon(Cause::kSilence, 0.0);
  ASSERT_FALSE(begin(MoveKind::kTransit, 30.0, 0.01));
  EXPECT_EQ(mover.command().percent, 25);
  mover.abandon(Cause::kSilence, 0.0);
  ASSERT_FALSE(begin(MoveKind::kTransit, 1.0, 60.0));
  EXPECT_EQ(mover.command().percent, 1);
}

TEST_F(EkiMoverAlone, ASearchAndAShortRetreatAreStraightAndALongRetreatIsNot) {
  guard.arm(5);
  ASSERT_FALSE(begin(MoveKind::kSearch, 12.0, 10.0, 5));
  EXPECT_EQ(mover.command().path, EkiPath::kLin);
  EXPECT_EQ(mover.command().duration_s, 10.0);
  EXPECT_EQ(mover.command().guard, EkiGuard::kInput);
  mover.abandon(Cause::kSilence, 0.0);
  ASSERT_FALSE(begin(MoveKind::kRetreat, -9.9, 10.0));
  EXPECT_EQ(mover.command().path, EkiPath::kLin);
  EXPECT_EQ(mover.command().guard, EkiGuard::kNone);
  mover.abandon(Cause::kSilence, 0.0);
  ASSERT_FALSE(begin(MoveKind::kRetreat, -10.1, 2.0));
  EXPECT_EQ(mover.command().path, EkiPath::kPtp);
  EXPECT_EQ(mover.command().percent, 1);
  mover.abandon(Cause::kSilence, 0.0);
  // The limits make it slower: 5 deg at 100 deg/s.
  ASSERT_FALSE(begin(MoveKind::kRetreat, -5.0, 0.01));
  EXPECT_NEAR(mover.command().duration_s, 0.05, 1e-9);
}

TEST_F(EkiMoverAlone, WithoutTheInputNothingIsGuardedByItAndFastSearchesAreRefused) {
  config.stop = EkiStop::kFlag;
  guard.arm(5);
  const auto refused = begin(MoveKind::kSearch, 5.0, 4.0, 5);
  ASSERT_TRUE(refused);
  expect(*refused, MoveOutcome::kRefused, Cause::kTooFastForFlag, 1, 1.25, 1.0);
  EXPECT_EQ(refused->at_rad, at_rad());
  const auto without_a_time = begin(MoveKind::kSearch, 5.0, 0.0, 5);
  ASSERT_TRUE(without_a_time);
  expect(*without_a_time, MoveOutcome::kRefused, Cause::kTooFastForFlag, 0, 100.0, 1.0);
  EXPECT_FALSE(begin(MoveKind::kSearch, 5.0, 5.01, 5));
  EXPECT_EQ(mover.command().guard, EkiGuard::kNone);
  mover.abandon(Cause::kSilence, 0.0);
  EXPECT_FALSE(begin(MoveKind::kRetreat, 5.0, 4.0)) << "only searches have a latch";
}

// ---- how it ends -------------------------------------------------------------------------------

TEST_F(EkiMoverAlone, ArrivesAtRestAfterTwoWindowsOfStates) {
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  moving(10, 0.5);
  arrive();
  const CoreResult result = done(EkiOutcome::kArrived);
  expect(result, MoveOutcome::kArrived, Cause::kNone);
  EXPECT_EQ(states, 10);
  EXPECT_NEAR(result.at_rad[1], target_deg[1] * kDeg, 1e-12);
}

TEST_F(EkiMoverAlone, WhatTheControllerSaysAgainstItIsTheCause) {
  frame.fault = 17;
  const std::tuple<EkiOutcome, MoveOutcome, Cause, double> ends[] = {
      {EkiOutcome::kSoftLimit, MoveOutcome::kRefused, Cause::kOutsideSoftLimits, 0},
      {EkiOutcome::kNotFeasible, MoveOutcome::kRefused, Cause::kNotFeasible, 0},
      {EkiOutcome::kNone, MoveOutcome::kRefused, Cause::kNotFeasible, 0},
      {EkiOutcome::kDeadMan, MoveOutcome::kRobotSilent, Cause::kDeadMan, 0},
      {EkiOutcome::kAborted, MoveOutcome::kNotFollowing, Cause::kProgramAborted, 17},
      {EkiOutcome::kInputAtStart, MoveOutcome::kUnexpectedContact, Cause::kTouchedOutsideSearch, 0},
      {EkiOutcome::kInput, MoveOutcome::kUnexpectedContact, Cause::kTouchedOutsideSearch, 0},
      {EkiOutcome::kStop, MoveOutcome::kStopped, Cause::kStopAsked, 0}};
  for (const auto& [said, outcome, cause, a] : ends) {
    ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
    moving();
    expect(done(said), outcome, cause, 0, a);
  }
  guard.arm(5);
  ASSERT_FALSE(begin(MoveKind::kSearch, 5.0, 10.0, 5));
  moving();
  expect(done(EkiOutcome::kInputAtStart), MoveOutcome::kRefused, Cause::kInputAtStart);
  guard.arm(5);
  ASSERT_FALSE(begin(MoveKind::kSearch, 5.0, 10.0, 5));
  moving();
  expect(done(EkiOutcome::kStop), MoveOutcome::kStopped, Cause::kStopAsked);
}

TEST_F(EkiMoverAlone, AnArmThatEndsElsewhereIsNamedWithBothAngles) {
  for (const double short_deg : {0.049, 0.051, -0.051}) {
    ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
    moving();
    at_deg[1] = target_deg[1] - short_deg;
    const CoreResult result = done(EkiOutcome::kArrived);
    if (std::abs(short_deg) < 0.05) {
      expect(result, MoveOutcome::kArrived, Cause::kNone);
    } else {
      expect(result, MoveOutcome::kNotFollowing, Cause::kNotAtTarget, 1, target_deg[1], at_deg[1]);
    }
  }
  // And nothing of it is said of the next.
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  moving();
  arrive();
  expect(done(EkiOutcome::kArrived), MoveOutcome::kArrived, Cause::kNone);
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
      expect(*result, MoveOutcome::kArrived, Cause::kNone);
      EXPECT_EQ(count, 10);
    } else {
      expect(*result, MoveOutcome::kArrived, Cause::kNotSettled, 0, 5 * drift_deg, 2.0, 0.021);
      EXPECT_NEAR(result->a, 5 * drift_deg, 1e-6);
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
    expect(*result, MoveOutcome::kNotFollowing, Cause::kProgramAborted, 0, 4);
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
  expect(*result, MoveOutcome::kRobotSilent, Cause::kCommandNotTaken, 0, 0.504);
  EXPECT_EQ(result->at_rad, at_rad());
}

TEST_F(EkiMoverAlone, AStopIsAskedForOnceAndGivenUpAfterTwoSeconds) {
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  moving(3);
  EXPECT_FALSE(mover.wants_stop());
  mover.halt(MoveOutcome::kStopped, Cause::kStopAsked, 3.0);
  mover.halt(MoveOutcome::kContactSilent, Cause::kSensorDead, 4.0);
  EXPECT_TRUE(mover.wants_stop());
  mover.stop_sent(now);
  EXPECT_FALSE(mover.wants_stop());
  const TimePoint sent = now;
  while (now - sent < 2000ms) ASSERT_FALSE(tick());
  const auto result = tick();
  ASSERT_TRUE(result);
  expect(*result, MoveOutcome::kRobotSilent, Cause::kCommandNotTaken, 0, 2.004);
}

TEST_F(EkiMoverAlone, AStopThatIsTakenEndsAsItWasAsked) {
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  moving(3);
  mover.halt(MoveOutcome::kStopped, Cause::kStopAsked, 3.0);
  mover.stop_sent(now);
  expect(done(EkiOutcome::kStop), MoveOutcome::kStopped, Cause::kStopAsked, 0, 3.0);
  mover.halt(MoveOutcome::kStopped, Cause::kStopAsked);
  EXPECT_FALSE(mover.busy() || mover.wants_stop());
}

TEST_F(EkiMoverAlone, CancelledBeforeItWasSentItSaysWhy) {
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  mover.halt(MoveOutcome::kStopped, Cause::kStopAsked);
  const CoreResult stopped = mover.cancel();
  expect(stopped, MoveOutcome::kStopped, Cause::kStopAsked);
  EXPECT_EQ(stopped.at_rad, at_rad());
  guard.arm(5);
  ASSERT_FALSE(begin(MoveKind::kSearch, 5.0, 10.0, 5));
  expect(mover.cancel(), MoveOutcome::kRefused, Cause::kTrippedAtStart);
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
  expect(done(EkiOutcome::kStop), MoveOutcome::kNotFollowing, Cause::kNotMoving, 0, 2.02, 3, 0.021);
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
  expect(done(EkiOutcome::kStop), MoveOutcome::kUnexpectedContact, Cause::kTouchedOutsideSearch);
  guard.touch(false);
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  moving(3);
  guard.set_alive(false);
  EXPECT_FALSE(tick());
  guard.set_alive(true);
  EXPECT_TRUE(mover.wants_stop());
  expect(done(EkiOutcome::kStop), MoveOutcome::kContactSilent, Cause::kSensorDead);
}

TEST_F(EkiMoverAlone, ARetreatThatEndsInContactSaysSo) {
  for (const bool open : {true, false}) {
    guard.touch(true);
    ASSERT_FALSE(begin(MoveKind::kRetreat, -1.0, 1.0));
    moving(3, -0.1);
    if (open) guard.touch(false);
    arrive();
    const CoreResult result = done(EkiOutcome::kArrived);
    if (open) expect(result, MoveOutcome::kArrived, Cause::kNone);
    if (!open) expect(result, MoveOutcome::kStillInContact, Cause::kContactNotOpen);
  }
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
  expect(result, MoveOutcome::kContact, Cause::kNone);
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
  expect(done(EkiOutcome::kArrived), MoveOutcome::kArrived, Cause::kNone);
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
  EXPECT_FALSE(tick());
  EXPECT_TRUE(mover.wants_stop());
  mover.stop_sent(now);
  guard.push(ContactEventKind::kContact, 5, heard);
  expect(done(EkiOutcome::kStop), MoveOutcome::kContactSilent, Cause::kInputMissed);
}

TEST_F(EkiMoverSearch, NoiseStopsItAtOnceAndIsRevoked) {
  search();
  moving(3);
  guard.push(ContactEventKind::kRevoked, 5, now);
  EXPECT_FALSE(tick());
  EXPECT_TRUE(mover.wants_stop());
  mover.stop_sent(now);
  expect(done(EkiOutcome::kStop), MoveOutcome::kRevoked, Cause::kNone);
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
  expect(result, MoveOutcome::kContact, Cause::kNone);
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
  expect(done(EkiOutcome::kStop), MoveOutcome::kContactSilent, Cause::kSensorDead);
  search();
  moving(3);
  guard.disarm();
  EXPECT_FALSE(tick());
  EXPECT_TRUE(mover.wants_stop());
  expect(done(EkiOutcome::kStop), MoveOutcome::kContactSilent, Cause::kArmExpired);
  search();
  moving(3);
  guard.arm(6);
  EXPECT_FALSE(tick());
  EXPECT_TRUE(mover.wants_stop());
  expect(done(EkiOutcome::kStop), MoveOutcome::kContactSilent, Cause::kArmExpired);
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
  expect(done(EkiOutcome::kArrived), MoveOutcome::kContactSilent, Cause::kSensorDead);
  arrived();
  guard.disarm();
  EXPECT_FALSE(tick());
  expect(done(EkiOutcome::kArrived), MoveOutcome::kContactSilent, Cause::kArmExpired);
  arrived();
  guard.arm(9);
  EXPECT_FALSE(tick());
  expect(done(EkiOutcome::kArrived), MoveOutcome::kContactSilent, Cause::kArmExpired);
  arrived();
  guard.push(ContactEventKind::kTrip, 5, now);
  EXPECT_FALSE(tick());
  guard.push(ContactEventKind::kRevoked, 5, now);
  expect(done(EkiOutcome::kArrived), MoveOutcome::kRevoked, Cause::kNone);
}

TEST_F(EkiMoverSearch, AnInputOrATripWithoutTheSensorsWordIsSilenceAfterATenth) {
  search();
  moving(3);
  expect(done(EkiOutcome::kInput), MoveOutcome::kContactSilent, Cause::kInputAlone, 0, 0.104);
  search();
  moving(3);
  guard.push(ContactEventKind::kTrip, 5, now);
  EXPECT_FALSE(tick());
  // Counted from the end of the motion, and told from the trip.
  expect(done(EkiOutcome::kInput), MoveOutcome::kContactSilent, Cause::kTripUnconfirmed, 0, 0.124,
         0.0, 1e-6);
  search();
  moving(3);
  EXPECT_FALSE(state(EkiProgress::kDone, EkiOutcome::kInput));
  guard.set_alive(false);
  EXPECT_FALSE(tick());
  guard.set_alive(true);
  expect(done(EkiOutcome::kInput), MoveOutcome::kContactSilent, Cause::kSensorDead);
}

TEST_F(EkiMoverSearch, ALatchOfAnotherMoveIsNone) {
  search();
  moving(20, 0.01);
  guard.push(ContactEventKind::kContact, 5, now - 4ms);
  latched(at_deg[1]);
  frame.latch_id = command - 1;
  expect(done(EkiOutcome::kInput), MoveOutcome::kContactSilent, Cause::kLatchMissing);
  search();
  moving(20, 0.01);
  guard.push(ContactEventKind::kContact, 5, now - 4ms);
  latched(at_deg[1]);
  frame.latch_deg = {at_deg[0]};
  expect(done(EkiOutcome::kInput), MoveOutcome::kContactSilent, Cause::kLatchMissing);
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
      expect(result, MoveOutcome::kContact, Cause::kNone);
    } else {
      expect(result, MoveOutcome::kContactSilent, Cause::kLatchAstray, 1, path_deg + beside_deg,
             path_deg, 1e-4);
    }
  }
}

TEST_F(EkiMoverAlone, AbandonedItSaysWhereTheArmWasSeenLast) {
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  moving(3);
  const CoreResult result = mover.abandon(Cause::kNotConnected, 0.3);
  expect(result, MoveOutcome::kRobotSilent, Cause::kNotConnected, 0, 0.3);
  EXPECT_EQ(result.at_rad, at_rad());
  EXPECT_FALSE(mover.busy());
  PositionRecord empty;
  EkiMover blind(config, nullptr, empty);
  ASSERT_FALSE(blind.start({3, MoveKind::kTransit, at_rad(), 0.0, 0}, at_rad(), now));
  EXPECT_EQ(blind.abandon(Cause::kNotConnected, 0.3).at_rad, AxisAngles{});
}

}  // namespace
}  // namespace cellcal::drivers
