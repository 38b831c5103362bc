// The rest at the end of a move and its result, for every cause of the end.

#include "drivers/units.h"
#include "tests/drivers/kuka/rsi/mover_rig.h"

namespace cellcal::drivers {
namespace {

using namespace std::chrono_literals;

/// Drifts on A3 from now on, too slowly for a following error.
void start_drift(MoverRig& rig, double deg_s) {
  rig.arm = [&rig, deg_s, from = rig.now](const AxisAngles& commanded) {
    AxisAngles actual = commanded;
    actual[2] += deg_s * kRadPerDeg * std::chrono::duration<double>(rig.now - from).count();
    return actual;
  };
}

/// A degree on A2 without contact.
std::optional<CoreResult> begin_search(MoverRig& rig) {
  rig.guard.arm(5);
  return rig.start(MoveKind::kSearch, 1.0, 1.0, 5);
}

// Windows of 48 ms, but not fewer than four packets.
TEST(MoverRest, TheEndOfASearchIsKnownTwoWindowsAfterTheMotionsEnd) {
  for (const auto& [cycle_s, cycles] : {std::pair{0.004, 24}, {0.012, 8}, {0.02, 8}, {0.002, 48}}) {
    MoverRig rig(cycle_s);
    ASSERT_FALSE(begin_search(rig));
    const auto end = rig.end();
    expect_end(end.result, MoveOutcome::kArrived, cause::None{});
    EXPECT_EQ(end.motionless, cycles) << cycle_s;
    EXPECT_NEAR(rig.commanded[1], 1.0 * kRadPerDeg, 1e-12);
  }
}

TEST(MoverRest, OfAnArmOnItsWayArrivalIsKnownAWindowAfterTheMotionsEnd) {
  for (const MoveKind kind : {MoveKind::kTransit, MoveKind::kRetreat})
    for (const auto& [cycle_s, cycles] :
         {std::pair{0.004, 12}, {0.012, 4}, {0.02, 4}, {0.002, 24}}) {
      MoverRig rig(cycle_s);
      ASSERT_FALSE(rig.start(kind, 1.0));
      const auto end = rig.end();
      expect_end(end.result, MoveOutcome::kArrived, cause::None{});
      EXPECT_EQ(end.motionless, cycles) << cycle_s;
      EXPECT_NEAR(rig.commanded[1], 1.0 * kRadPerDeg, 1e-12);
    }
}

TEST(MoverRest, ARetreatWhoseContactIsStillClosedIsNotOverBeforeTheArmRests) {
  MoverRig rig;
  rig.guard.touch(true);
  ASSERT_FALSE(rig.start(MoveKind::kRetreat, -1.0));
  const auto end = rig.end();
  expect_end(end.result, MoveOutcome::kStillInContact, cause::ContactNotOpen{});
  EXPECT_EQ(end.motionless, 25) << "and the sensor has said so since";
}

TEST(MoverRest, AMoveWithoutTravelArrivesAsWell) {
  MoverRig rig;
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 0.0));
  EXPECT_TRUE(rig.mover.busy());
  expect_end(rig.end().result, MoveOutcome::kArrived, cause::None{});
  EXPECT_FALSE(rig.cycle());
}

TEST(MoverRest, LessThanHalfAThousandthOfADegreePerWindowIsRest) {
  MoverRig rig;
  start_drift(rig, 0.0004 / 0.048);
  ASSERT_FALSE(begin_search(rig));
  const auto end = rig.end();
  expect_end(end.result, MoveOutcome::kArrived, cause::None{});
  EXPECT_EQ(end.motionless, 24);
}

TEST(MoverRest, AnArmThatNeverRestsIsNamedAfterASecondWithWhatItMovesBy) {
  MoverRig rig;
  ASSERT_FALSE(begin_search(rig));
  start_drift(rig, 0.0008 / 0.048);
  const auto end = rig.end();
  expect_end(end.result, MoveOutcome::kArrived, cause::NotSettled{2, 0.0008, 1.0}, 1e-6);
  EXPECT_NEAR(end.motionless, 250, 1);
}

TEST(MoverRest, WhatStoppedAnArmThatNeverRestsStaysTheCause) {
  MoverRig rig;
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 10.0));
  rig.run(60);
  start_drift(rig, 0.0008 / 0.048);
  rig.mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  const auto end = rig.end();
  expect_end(end.result, MoveOutcome::kStopped, cause::StopAsked{});
  EXPECT_NEAR(end.motionless, 250, 1);
}

TEST(MoverRest, AnArmThatEndsElsewhereIsNamedAfterASecondWithBothAngles) {
  for (const double short_deg : {0.06, -0.06}) {
    MoverRig rig;
    ASSERT_FALSE(rig.start(MoveKind::kTransit, 0.5));
    while (rig.commanded[1] < 0.5 * kRadPerDeg) rig.run(1);
    rig.arm = [=](AxisAngles actual) {
      actual[1] -= short_deg * kRadPerDeg;
      return actual;
    };
    const auto end = rig.end();
    expect_end(end.result, MoveOutcome::kNotFollowing,
               cause::AxisNotFollowing{1, 0.5, 0.5 - short_deg});
    EXPECT_NEAR(end.cycles, 250, 1);
  }
}

TEST(MoverRest, AnArmThatCatchesUpWithinTheSecondHasArrived) {
  MoverRig rig;
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 0.5));
  while (rig.commanded[1] < 0.5 * kRadPerDeg) rig.run(1);
  int cycles = 0;
  rig.arm = [&](AxisAngles actual) {
    if (++cycles < 100) actual[1] -= 0.06 * kRadPerDeg;
    return actual;
  };
  const auto end = rig.end();
  expect_end(end.result, MoveOutcome::kArrived, cause::None{});
  EXPECT_GT(end.cycles, 100);
  EXPECT_LT(end.cycles, 130);
}

TEST(MoverRest, ForWhatWasStoppedRestIsEnoughWhereverTheArmIs) {
  MoverRig rig;
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 10.0));
  rig.run(40);
  rig.mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  rig.arm = [](AxisAngles actual) {
    actual[1] -= 0.06 * kRadPerDeg;
    return actual;
  };
  const auto end = rig.end();
  expect_end(end.result, MoveOutcome::kStopped, cause::StopAsked{});
  EXPECT_EQ(end.motionless, 24);
}

TEST(MoverRest, NothingOfAnEarlierEndIsSaidOfTheNextMove) {
  MoverRig rig;
  // A complete result, after a second of settling.
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 0.5));
  while (rig.commanded[1] < 0.5 * kRadPerDeg) rig.run(1);
  rig.arm = [](AxisAngles actual) {
    actual[1] -= 0.06 * kRadPerDeg;
    return actual;
  };
  EXPECT_EQ(rig.end().result.outcome, MoveOutcome::kNotFollowing);
  rig.arm = [](const AxisAngles& commanded) { return commanded; };
  for (int i = 0; i < 120; ++i) rig.cycle();
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 0.5));
  const auto end = rig.end();
  expect_end(end.result, MoveOutcome::kArrived, cause::None{});
  EXPECT_EQ(end.motionless, 12);
  // A stopped move, and a move without travel after it.
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 10.0));
  rig.run(40);
  rig.mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  rig.end();
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 0.0));
  expect_end(rig.end().result, MoveOutcome::kArrived, cause::None{});
}

TEST(MoverRest, ASecondStopChangesNothingAboutTheFirst) {
  MoverRig rig;
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 10.0));
  rig.run(60);
  rig.mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  rig.run(5);
  const AxisAngles braking = rig.commanded;
  rig.mover.halt(MoveOutcome::kRobotSilent, cause::LateReplies{2});
  rig.run(1);
  EXPECT_NE(rig.commanded, braking) << "still on its ramp";
  const auto end = rig.end();
  expect_end(end.result, MoveOutcome::kStopped, cause::StopAsked{});
  // At rest a stop has no effect.
  rig.mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  EXPECT_FALSE(rig.mover.busy());
  EXPECT_FALSE(rig.cycle());
}

TEST(MoverRest, StoppedWhileItSettlesAnArrivalIsAStop) {
  MoverRig rig;
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 0.5));
  while (rig.commanded[1] < 0.5 * kRadPerDeg) rig.run(1);
  rig.run(10);
  rig.mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  const auto end = rig.end();
  expect_end(end.result, MoveOutcome::kStopped, cause::StopAsked{});
  EXPECT_EQ(end.cycles, 24) << "two windows of rest from the stop on";
}

TEST(MoverRest, APacketThatIsDamagedHoldsEverythingButTheSensor) {
  MoverRig rig;
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 10.0));
  rig.run(60);
  const AxisAngles before = rig.commanded;
  for (int i = 0; i < 30; ++i) EXPECT_FALSE(rig.cycle(true, false));
  EXPECT_EQ(rig.commanded, before);
  rig.guard.set_alive(false);
  EXPECT_FALSE(rig.cycle(true, false));
  rig.guard.set_alive(true);
  expect_end(rig.end().result, MoveOutcome::kContactSilent, cause::SensorDead{});
}

TEST(MoverAbandoned, SaysWhereTheArmWasCommandedToAndWhy) {
  MoverRig rig;
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 10.0));
  rig.run(60);
  const CoreResult result = rig.mover.abandon(cause::Silence{0.25});
  expect_end(result, MoveOutcome::kRobotSilent, cause::Silence{0.25});
  EXPECT_EQ(result.at_rad, rig.commanded);
  EXPECT_EQ(result.ipoc, rig.ipoc);
  EXPECT_EQ(result.id, rig.id);
  EXPECT_FALSE(rig.mover.busy());
}

TEST(MoverAbandoned, AnEarlierSilenceOfTheRobotStaysTheCauseAndNoOtherEnd) {
  MoverRig rig;
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 10.0));
  rig.run(60);
  rig.mover.halt(MoveOutcome::kRobotSilent, cause::LateReplies{3});
  expect_end(rig.mover.abandon(cause::Silence{0.25}), MoveOutcome::kRobotSilent,
             cause::LateReplies{3});
  ASSERT_FALSE(rig.start(MoveKind::kTransit, 1.0));
  rig.mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  expect_end(rig.mover.abandon(cause::Silence{0.25}), MoveOutcome::kRobotSilent,
             cause::Silence{0.25});
}

TEST(MoverAbandoned, WithoutAnyPacketNobodyKnowsWhere) {
  RsiConfig config;
  config.limits.assign(1, {-9, 9, 1, 5, 50});
  PositionRecord record;
  Mover mover(config, nullptr, record);
  ASSERT_FALSE(mover.start({4, MoveKind::kTransit, {1.0}, 0.0, 0}, {0.0}));
  const CoreResult result = mover.abandon(cause::Silence{0.5});
  EXPECT_EQ(result.at_rad, AxisAngles{});
  EXPECT_EQ(result.ipoc, 0u);
  EXPECT_EQ(result.id, 4u);
}

}  // namespace
}  // namespace cellcal::drivers
