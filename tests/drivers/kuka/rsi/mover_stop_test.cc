// Stops of the mover, their hardness, and the latch.

#include "drivers/units.h"
#include "tests/drivers/kuka/rsi/mover_rig.h"

namespace cellcal::drivers {
namespace {

using namespace std::chrono_literals;

double step_deg(MoverRig& rig) {
  const double before = rig.commanded[1];
  EXPECT_FALSE(rig.cycle());
  return (rig.commanded[1] - before) / kRadPerDeg;
}

struct Searching : testing::Test {
  Searching() { rig.guard.arm(5); }
  /// 0.5 deg/s, below probing speed.
  void begin(double deg_s = 0.5) {
    ASSERT_FALSE(rig.start(MoveKind::kSearch, 10 * deg_s, 10.0, 5));
    rig.run(100);
  }
  void confirm(Duration age, int bounces = 3) {
    rig.guard.push(ContactEventKind::kContact, 5, rig.now - age, bounces);
  }
  MoverRig rig;
};

TEST_F(Searching, LatchesWhereTheArmWasAtTheFirstEdge) {
  begin();
  const double speed = step_deg(rig);
  const TimePoint edge = rig.now - 3ms;
  // AIPos is the command of the preceding packet; linear between packets.
  const double at_packet = rig.commanded[1] - speed * kRadPerDeg;
  const double at_edge = at_packet - speed * kRadPerDeg * 3.0 / 4.0;
  rig.guard.trip(5, edge);
  EXPECT_EQ(step_deg(rig), 0.0);
  const TimePoint frozen = rig.now;
  rig.guard.push(ContactEventKind::kContact, 5, edge, 3);
  const auto end = rig.end();
  expect_end(end.result, MoveOutcome::kContact, cause::None{});
  const Latch& latch = *end.result.latch;
  EXPECT_NEAR(latch.contact_rad[1], at_edge, 1e-9);
  EXPECT_NEAR(latch.settled_rad[1], rig.commanded[1], 1e-12);
  EXPECT_EQ(latch.contact_time, edge);
  EXPECT_GE(latch.time_sigma_s, 20e-6);
  EXPECT_LT(latch.time_sigma_s, 1e-3);
  EXPECT_NEAR(latch.reaction_s, std::chrono::duration<double>(frozen - edge).count(), 1e-12);
  EXPECT_EQ(latch.bounces, 3);
  EXPECT_EQ(end.cycles, 24) << "two windows of rest after the verdict";
}

TEST_F(Searching, NeitherLatchNorContactIsLeftForTheNextSearch) {
  begin();
  rig.guard.trip(5, rig.now - 1ms);
  confirm(1ms);
  expect_end(rig.end().result, MoveOutcome::kContact, cause::None{});
  rig.guard.arm(6);
  ASSERT_FALSE(rig.start(MoveKind::kSearch, 0.5, 1.0, 6));
  expect_end(rig.end().result, MoveOutcome::kArrived, cause::None{});
}

TEST_F(Searching, ATripWithoutAVerdictIsSilenceAfterATenthOfASecond) {
  begin();
  rig.guard.trip(5, rig.now);
  EXPECT_EQ(step_deg(rig), 0.0);
  const TimePoint frozen = rig.now;
  // At exactly 100 ms the verdict still counts.
  while (rig.now - frozen < 100ms) rig.run(1);
  rig.guard.push(ContactEventKind::kRevoked, 5, rig.now);
  expect_end(rig.end().result, MoveOutcome::kRevoked, cause::None{});

  rig.guard.arm(6);
  ASSERT_FALSE(rig.start(MoveKind::kSearch, 5.0, 10.0, 6));
  rig.run(100);
  rig.guard.trip(6, rig.now);
  expect_end(rig.end().result, MoveOutcome::kContactSilent, cause::TripUnconfirmed{0.104});
}

TEST_F(Searching, RevokedSilentAndDisarmedAreEndsOfTheirOwn) {
  begin();
  rig.guard.push(ContactEventKind::kRevoked, 5, rig.now);
  expect_end(rig.end().result, MoveOutcome::kRevoked, cause::None{});
  rig.guard.arm(5);
  begin();
  rig.guard.set_alive(false);
  EXPECT_EQ(step_deg(rig), 0.0);
  rig.guard.set_alive(true);
  expect_end(rig.end().result, MoveOutcome::kContactSilent, cause::SensorDead{});
  begin();
  rig.guard.trip(5, rig.now);
  rig.run(2);
  rig.guard.set_alive(false);
  rig.run(2);
  rig.guard.set_alive(true);
  expect_end(rig.end().result, MoveOutcome::kContactSilent, cause::SensorDead{});
  rig.guard.arm(5);
  begin();
  rig.guard.disarm();
  EXPECT_EQ(step_deg(rig), 0.0);
  expect_end(rig.end().result, MoveOutcome::kContactSilent, cause::ArmExpired{true});
  rig.guard.arm(5);
  begin();
  rig.guard.arm(9);  // another arming than this search's
  EXPECT_EQ(step_deg(rig), 0.0);
  expect_end(rig.end().result, MoveOutcome::kContactSilent, cause::ArmExpired{true});
}

TEST_F(Searching, AStopWhileTheVerdictIsAwaitedDoesNotHideTheContact) {
  begin();
  rig.guard.trip(5, rig.now - 1ms);
  rig.run(2);
  rig.mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  confirm(9ms);
  expect_end(rig.end().result, MoveOutcome::kContact, cause::None{});
}

TEST_F(Searching, AfterAStopNothingOfTheSensorChangesTheEnd) {
  begin();
  rig.mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  EXPECT_EQ(step_deg(rig), 0.0);
  rig.guard.trip(5, rig.now);
  expect_end(rig.end().result, MoveOutcome::kStopped, cause::StopAsked{});
}

TEST_F(Searching, AContactThatIsOlderThanTheRecordIsNone) {
  begin();
  rig.guard.trip(5, rig.now - 5s);
  rig.run(1);
  confirm(5s);
  const auto result = rig.end().result;
  expect_end(result, MoveOutcome::kContactSilent, cause::StampOutside{5.0 + 24 * 0.004}, 1e-6);
}

// Far from everything commanded from 0.2 s before the contact until now.
TEST_F(Searching, AContactWhoseStampItsHeartbeatsDenyIsRefusedAndNotLatched) {
  begin();
  rig.guard.trip(5, rig.now - 100ms);
  EXPECT_EQ(step_deg(rig), 0.0) << "a stop is never doubted";
  rig.guard.push({ContactEventKind::kContact, 5, rig.now - 100ms, 20e-6, 0, 0.095});
  const auto end = rig.end();
  expect_end(end.result, MoveOutcome::kContactSilent, cause::StampDenied{0.095});
  EXPECT_FALSE(end.result.latch);
}

TEST_F(Searching, ATripWhoseMessageIsLostStopsAndIsMeasuredByTheContactBehindIt) {
  begin();
  rig.guard.end_arming(ArmEnd::kTripped);
  EXPECT_EQ(step_deg(rig), 0.0);
  confirm(9ms);
  const auto end = rig.end();
  expect_end(end.result, MoveOutcome::kContact, cause::None{});
  EXPECT_TRUE(end.result.latch);
  rig.guard.arm(6);
  ASSERT_FALSE(rig.start(MoveKind::kSearch, 5.0, 10.0, 6));
  rig.run(100);
  rig.guard.end_arming(ArmEnd::kTripped);
  const auto lost = rig.end().result;
  EXPECT_EQ(lost.outcome, MoveOutcome::kContactSilent);
  EXPECT_TRUE(is<cause::TripUnconfirmed>(lost.cause)) << words(lost);
}

TEST_F(Searching, AVerdictThatIsNotThereIsMissingOnlyBesideHeartbeatsThatAre) {
  begin();
  rig.guard.trip(5, rig.now - 1ms);
  rig.guard.set_heard(false);
  rig.run(50);  // 0.2 s: late or silent, undecided
  confirm(201ms);
  rig.guard.set_heard(true);
  expect_end(rig.end().result, MoveOutcome::kContact, cause::None{});
}

TEST_F(Searching, AnAngleBesideTheCommandsAroundTheContactIsNamedOnEitherSide) {
  for (const double side : {1.0, -1.0}) {
    for (const double off_deg : {0.049, 0.051}) {
      rig.guard.arm(5);
      begin();
      rig.guard.trip(5, rig.now - 2ms);
      rig.arm = [=](AxisAngles actual) {
        actual[2] += side * off_deg * kRadPerDeg;
        return actual;
      };
      rig.run(2);
      confirm(1ms);  // between two packets with the arm there
      const auto result = rig.end().result;
      rig.arm = [](const AxisAngles& commanded) { return commanded; };
      if (off_deg < 0.05) {
        expect_end(result, MoveOutcome::kContact, cause::None{});
      } else {
        EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing);
        expect_cause(result.cause, cause::AxisNotFollowing{2, 0.0, side * off_deg});
        EXPECT_FALSE(result.latch);
      }
      for (int i = 0; i < 120; ++i) rig.cycle();
    }
  }
}

TEST_F(Searching, FasterThanProbingItBrakesWithinTwentyMilliseconds) {
  begin(4.0);
  rig.guard.trip(5, rig.now);
  int moving = 0;
  while (step_deg(rig) > 0.0) ++moving;
  EXPECT_GE(moving, 3);
  EXPECT_LE(moving, 5);
}

TEST(MoverStop, ATransitBrakesAtItsLimits) {
  MoverRig rig;
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 90.0));
  rig.run(150);
  const double speed = step_deg(rig) / 0.004;
  EXPECT_NEAR(speed, 100.0, 1e-6);
  rig.mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  int moving = 0;
  while (step_deg(rig) > 0.0) ++moving;
  EXPECT_NEAR(0.004 * moving, 100.0 / 400.0 + 400.0 / 4000.0, 0.008);
}

TEST(MoverStop, AnArmThatIsLedAstrayInSpaceIsBrakedAtOnceAndOnTheAxesAtItsLimits) {
  for (const bool in_space : {true, false}) {
    MoverRig rig;
    rig.config.space.on = in_space;
    ASSERT_FALSE(rig.start(MoveKind::kTransit, 90.0));
    rig.run(150);
    rig.arm = [](AxisAngles actual) {
      actual[0] += 0.06 * kRadPerDeg;
      return actual;
    };
    step_deg(rig);
    int moving = 0;
    while (step_deg(rig) > 0.0) ++moving;
    EXPECT_EQ(moving <= 5, in_space) << moving;
    EXPECT_EQ(moving >= 60, !in_space) << moving;
    expect_end(rig.end().result, MoveOutcome::kNotFollowing, cause::AxisNotFollowing{0, 0.0, 0.06});
  }
}

TEST(MoverStop, AnArmThatLeavesItsPathWhileItIsStoppedEndsByTheFirstCause) {
  MoverRig rig;
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 90.0));
  rig.run(150);
  rig.mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  rig.run(2);
  rig.arm = [](AxisAngles actual) {
    actual[0] += 0.06 * kRadPerDeg;
    return actual;
  };
  expect_end(rig.end().result, MoveOutcome::kStopped, cause::StopAsked{});
}

TEST(MoverStop, AReplyThatIsNotHeardEndsABrakeWhereTheArmIsHeld) {
  MoverRig rig;
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 90.0));
  rig.run(150);
  rig.mover.halt(MoveOutcome::kRobotSilent, cause::LateReplies{3});
  rig.run(2);
  const AxisAngles held = rig.commanded;
  EXPECT_FALSE(rig.cycle(false));
  EXPECT_EQ(step_deg(rig), 0.0);
  EXPECT_EQ(rig.commanded, held);
  const auto end = rig.end();
  expect_end(end.result, MoveOutcome::kRobotSilent, cause::LateReplies{3});
}

TEST(MoverStop, ACommandThatWasNotAcceptedIsWithdrawnFromAFrozenArm) {
  MoverRig rig;
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 90.0));
  rig.run(5);  // slow enough for a freeze
  const AxisAngles held = rig.commanded;
  rig.run(1);
  ASSERT_NE(rig.commanded, held);
  rig.mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  EXPECT_FALSE(rig.cycle(false, true, false));
  EXPECT_EQ(rig.commanded, held);
}

TEST(MoverStop, RepliesThatAreNotHeardOnTheWayDoNotEndIt) {
  MoverRig rig;
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 1.0));
  rig.run(20);
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(rig.cycle(false));
  EXPECT_GT(step_deg(rig), 0.0);
  expect_end(rig.end().result, MoveOutcome::kArrived, cause::None{});
}

TEST(MoverStop, ARetreatThatIsHeldOnItsWayStillHasToOpenOnItsFirstLeg) {
  double at_deg[2] = {};
  for (const bool held : {false, true}) {
    MoverRig rig;
    rig.guard.touch(true);
    Move move{++rig.id, MoveKind::kRetreat, rig.commanded, 0.0, 0};
    AxisAngles way = rig.commanded;
    way[1] -= 2 * kRadPerDeg;
    move.via.push_back({way, 0.5, 0.5});
    move.target_rad[1] -= 8 * kRadPerDeg;
    rig.mover.listen(rig.now);
    ASSERT_FALSE(rig.mover.start(move, rig.commanded));
    rig.run(28);
    if (held) {
      EXPECT_FALSE(rig.cycle(false));
    }
    const auto result = rig.end().result;
    EXPECT_EQ(result.outcome, MoveOutcome::kStillInContact) << words(result);
    at_deg[held] = rig.commanded[1] / kRadPerDeg;
  }
  EXPECT_GE(at_deg[true], at_deg[false]) << "no farther than one that was not held";
}

TEST(MoverStop, ThatARetreatsContactIsClosedIsSaidOnlyByWordsOfTheSensorFromBehindIt) {
  enum Ending { kOpens, kStaysClosed, kDies };
  for (const Ending ending : {kOpens, kStaysClosed, kDies}) {
    SCOPED_TRACE(ending);
    MoverRig rig;
    rig.guard.touch(true);
    ASSERT_FALSE(rig.start(MoveKind::kRetreat, -1.0));
    rig.run(5);
    rig.guard.set_heard(false);
    rig.run(250);  // at rest for a long time, without data
    if (ending == kOpens) rig.guard.touch(false);
    if (ending == kDies) rig.guard.set_alive(false);
    if (ending != kDies) rig.guard.set_heard(true);
    const auto result = rig.end().result;
    if (ending == kOpens) expect_end(result, MoveOutcome::kArrived, cause::None{});
    if (ending == kStaysClosed)
      expect_end(result, MoveOutcome::kStillInContact, cause::ContactNotOpen{});
    if (ending == kDies) expect_end(result, MoveOutcome::kContactSilent, cause::SensorDead{});
  }
}

TEST(MoverStop, ARetreatWhoseOpeningIsHeardLateIsHaltedByThisComputersLateness) {
  for (const double late_s : {0.120, 0.010}) {
    MoverRig rig;
    rig.guard.touch(true);
    Move move{++rig.id, MoveKind::kRetreat, rig.commanded, 0.0, 0};
    AxisAngles way = rig.commanded;
    way[1] -= 2 * kRadPerDeg;
    move.via.push_back({way, 0.5, 0.5});
    move.target_rad[1] -= 8 * kRadPerDeg;
    rig.mover.listen(rig.now);
    ASSERT_FALSE(rig.mover.start(move, rig.commanded));
    rig.run(5);
    rig.guard.set_heard(false);
    rig.run(250);
    EXPECT_GT(rig.commanded[1], move.target_rad[1]) << "it is not driven on";
    rig.guard.touch(false);
    rig.guard.set_said_late(late_s);
    rig.guard.set_heard(true);
    const auto result = rig.end().result;
    EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
    EXPECT_EQ(is<cause::SensorLate>(result.cause), late_s > 0.025) << words(result);
    EXPECT_EQ(is<cause::OpeningUnheard>(result.cause), late_s < 0.025) << words(result);
    EXPECT_EQ(result.interruption, late_s > 0.025 ? Interruption::kLateBytes : Interruption::kNone);
  }
}

TEST(MoverStop, ContactOutsideOfASearchAndASensorThatDies) {
  MoverRig rig;
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 10.0));
  rig.run(60);
  rig.guard.touch(true);
  expect_end(rig.end().result, MoveOutcome::kUnexpectedContact, cause::TouchedOutsideSearch{});
  // It begins in contact and is still in contact at its end.
  ASSERT_FALSE(rig.start(MoveKind::kRetreat, -1.0));
  expect_end(rig.end().result, MoveOutcome::kStillInContact, cause::ContactNotOpen{});
  ASSERT_FALSE(rig.start(MoveKind::kRetreat, -1.0));
  rig.run(10);
  rig.guard.touch(false);
  expect_end(rig.end().result, MoveOutcome::kArrived, cause::None{});
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 10.0));
  rig.run(60);
  rig.guard.set_alive(false);
  rig.run(1);
  rig.guard.set_alive(true);
  expect_end(rig.end().result, MoveOutcome::kContactSilent, cause::SensorDead{});
}

TEST(MoverStop, ATripOfAnotherArmingEndsATransitAsATouch) {
  MoverRig rig;
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 10.0));
  rig.run(60);
  rig.guard.trip(99, rig.now);
  expect_end(rig.end().result, MoveOutcome::kUnexpectedContact, cause::TouchedOutsideSearch{});
}

TEST(MoverStop, ARefusalNamesWhatTheSensorLacks) {
  MoverRig rig;
  rig.guard.arm(7);
  const auto armed = rig.start(MoveKind::kSearch, 1.0, 1.0, 5);
  ASSERT_TRUE(armed);
  expect_end(*armed, MoveOutcome::kRefused, cause::ArmedOtherwise{5, 7});
  EXPECT_EQ(armed->at_rad, rig.commanded);
  EXPECT_EQ(armed->id, rig.id);
  EXPECT_FALSE(rig.mover.busy());
  rig.guard.disarm();
  expect_end(*rig.start(MoveKind::kSearch, 1.0, 1.0, 5), MoveOutcome::kRefused, cause::NotArmed{5});
  rig.guard.arm(5);
  rig.guard.set_alive(false);
  expect_end(*rig.start(MoveKind::kSearch, 1.0, 1.0, 5), MoveOutcome::kRefused,
             cause::SensorDead{});
  expect_end(*rig.start(MoveKind::kTransit, 1.0), MoveOutcome::kContactSilent, cause::SensorDead{});
  rig.guard.set_alive(true);
  rig.guard.touch(true);
  expect_end(*rig.start(MoveKind::kSearch, 1.0, 1.0, 5), MoveOutcome::kRefused,
             cause::TouchingAtStart{});
  expect_end(*rig.start(MoveKind::kTransit, 1.0), MoveOutcome::kUnexpectedContact,
             cause::TouchedOutsideSearch{});
  rig.guard.touch(false);
  rig.guard.push(ContactEventKind::kTrip, 5, rig.now);
  expect_end(*rig.start(MoveKind::kSearch, 1.0, 1.0, 5), MoveOutcome::kRefused,
             cause::TrippedAtStart{});
  MoverRig deaf(0.004, false);
  expect_end(*deaf.start(MoveKind::kSearch, 1.0, 1.0, 5), MoveOutcome::kRefused, cause::NoSensor{});
  EXPECT_FALSE(deaf.start(MoveKind::kTransit, 1.0));
  expect_end(deaf.end().result, MoveOutcome::kArrived, cause::None{});
}

TEST(MoverStop, ARetreatsContactMayChatterForFiftyMilliseconds) {
  for (const auto& [closed_after, outcome] :
       {std::pair{48ms, MoveOutcome::kArrived}, {56ms, MoveOutcome::kUnexpectedContact}}) {
    MoverRig rig;
    rig.guard.touch(true);
    ASSERT_FALSE(rig.start(MoveKind::kRetreat, -1.0));
    rig.run(10);
    rig.guard.touch(false);
    rig.run(1);
    const TimePoint opened = rig.now;
    while (rig.now - opened < closed_after - 4ms) rig.run(1);
    rig.guard.touch(true);
    rig.run(1);
    rig.guard.touch(false);
    EXPECT_EQ(rig.end().result.outcome, outcome) << closed_after.count();
  }
}

}  // namespace
}  // namespace cellcal::drivers
