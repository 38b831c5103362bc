// The EKI adapter's mover by itself, state by state: its commands, and the outcome and figures of
// each end.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/drivers/kuka/eki/eki_mover_alone.h"

namespace cellcal::drivers {
namespace {

using namespace std::chrono_literals;

// ---- commands ----------------------------------------------------------------------------------

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

// ---- ends --------------------------------------------------------------------------------------

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

struct EkiMoverWithoutASensor : EkiMoverAlone {
  EkiMoverWithoutASensor() : EkiMoverAlone(false) {}
};

TEST_F(EkiMoverWithoutASensor, ATransitArrivesAndIsNotStoppedForASilentOne) {
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  moving(10, 0.5);
  EXPECT_FALSE(mover.wants_stop());
  arrive();
  expect(done(EkiOutcome::kArrived), MoveOutcome::kArrived, cause::None{});
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
  // The next move is unaffected.
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

TEST_F(EkiMoverAlone, AnEndThatTheNextStateTakesBackStopsTheArm) {
  const std::tuple<std::uint32_t, EkiProgress, EkiOutcome, int> damaged[] = {
      {0, EkiProgress::kDone, EkiOutcome::kNone, 3},
      {0, EkiProgress::kDone, EkiOutcome::kArrived, 0},  // before the controller has begun it
      {0, EkiProgress::kDone, EkiOutcome::kInput, 3},
      {0, EkiProgress::kIdle, EkiOutcome::kNone, 3},
      {1, EkiProgress::kMoving, EkiOutcome::kNone, 3}};
  for (const auto& [id_off, progress, outcome, before] : damaged) {
    ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
    moving(before);
    command += id_off;
    ASSERT_FALSE(state(progress, outcome));
    command -= id_off;
    moving();
    EXPECT_TRUE(mover.wants_stop());
    mover.stop_sent(now);
    EXPECT_TRUE(mover.is_stopping()) << "until the controller says that it rests";
    moving(10);
    expect(done(EkiOutcome::kStop), MoveOutcome::kNotFollowing, cause::EndWithdrawn{});
  }
}

TEST_F(EkiMoverAlone, AStopIsAlsoSentWhereTheControllerHasReportedTheEnd) {
  ASSERT_FALSE(begin(MoveKind::kTransit, 5.0));
  moving(3);
  arrive();
  ASSERT_FALSE(state(EkiProgress::kDone, EkiOutcome::kArrived));
  mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  EXPECT_TRUE(mover.wants_stop());
  mover.stop_sent(now);
  EXPECT_FALSE(mover.is_stopping());
  expect(done(EkiOutcome::kArrived), MoveOutcome::kArrived, cause::None{});
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
  EXPECT_FALSE(mover.wants_sending());
  EXPECT_TRUE(mover.wants_stop()) << "the end of the leg may have been a damaged state's";
  const CoreResult stopped = done(EkiOutcome::kArrived);
  expect(stopped, MoveOutcome::kStopped, cause::StopAsked{});
  EXPECT_NEAR(stopped.at_rad[1], -10.0 * kDeg, 1e-9);
}

TEST_F(EkiMoverAlone, AnArmThatIsNotAtTheWayPointIsStoppedThere) {
  mover.listen(now);
  ASSERT_FALSE(mover.start({++id,
                            MoveKind::kTransit,
                            {10.0 * kDeg, 0.0},
                            0.0,
                            0,
                            {{{10.0 * kDeg, -10.0 * kDeg}, 0.5, 0.5}}},
                           at_rad(), now));
  mover.sent(++command);
  moving(3);
  ASSERT_FALSE(state(EkiProgress::kDone, EkiOutcome::kArrived)) << "10 deg before it";
  EXPECT_FALSE(mover.wants_sending()) << "no next leg";
  EXPECT_TRUE(mover.wants_stop());
  mover.stop_sent(now);
  expect(done(EkiOutcome::kStop), MoveOutcome::kNotFollowing, cause::EndWithdrawn{});
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

TEST_F(EkiMoverAlone, ARetreatWhoseSensorFallsSilentAtItsEndDoesNotCountAsOpen) {
  guard.touch(true);
  guard.set_said(now);
  ASSERT_FALSE(begin(MoveKind::kRetreat, -1.0, 1.0));
  moving(3, -0.1);
  arrive();
  for (int i = 0; i < 12; ++i) ASSERT_FALSE(state(EkiProgress::kDone, EkiOutcome::kArrived));
  guard.touch(false);  // as of a sensor that was lost
  guard.set_alive(false);
  expect(done(EkiOutcome::kArrived), MoveOutcome::kContactSilent, cause::SensorDead{});
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
