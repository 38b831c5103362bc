// Guarded moves: stop path, source of the angles, and cases that must never count as a touch.

#include "tests/drivers/kuka/eki/eki_rig.h"

namespace cellcal::drivers {
namespace {

EkiConfig by_flag() {
  EkiConfig config = eki_config();
  config.stop = EkiStop::kFlag;
  return config;
}

/// Ready, with a wall 1.5 deg ahead of A1.
void prepare(EkiRig& rig) {
  rig.make_ready();
  rig.wall_rad = 1.5 * kEkiDeg;
}

TEST(EkiSearch, LatchesTheAnglesThatTheControllersInterruptTook) {
  EkiRig rig;
  prepare(rig);
  const CoreResult result = rig.search(3.0, 3.0);
  ASSERT_EQ(result.outcome, MoveOutcome::kContact) << words(result);
  ASSERT_TRUE(result.latch.has_value());
  EXPECT_NEAR(result.latch->contact_rad[0] / kEkiDeg, rig.touched_deg, 1e-5);
  EXPECT_EQ(result.latch->contact_time, rig.touched_at);
  EXPECT_NEAR(result.latch->settled_rad[0] / kEkiDeg, rig.true_deg(), 1e-4);
  EXPECT_GT(result.latch->settled_rad[0], result.latch->contact_rad[0]);
  EXPECT_DOUBLE_EQ(result.latch->time_sigma_s, eki_config().latch_jitter_s);
  EXPECT_LT(result.latch->reaction_s, 0.2);
}

TEST(EkiSearch, EndsWithTheTcpAndTheAnglesOfOneRestingArm) {
  EkiRig rig;  // without geometry: X is A1 at a metre
  prepare(rig);
  const auto off_m = [&] {
    const RobotState state = rig.core.state();
    return state.stated_tcp ? std::abs((*state.stated_tcp)[0] - state.actual_rad[0]) : 1.0;
  };
  EXPECT_LT(off_m(), 1e-6) << "referenced";
  ASSERT_EQ(rig.search(3.0, 3.0).outcome, MoveOutcome::kContact);
  EXPECT_LT(off_m(), 1e-4) << "$POS_ACT is the set-point's, $AXIS_ACT_MEAS the arm's";
  EXPECT_GT(rig.core.state().actual_rad[0], 1.4 * kEkiDeg);
}

TEST(EkiSearch, TakesTheLatchsDelayOffAtTheSpeedOfTheSearch) {
  for (const double cruise_s : {3.0, 6.0}) {
    sim::EkiControllerConfig controller = eki_controller();
    controller.latches_setpoint = true;  // ahead of the arm by the servo's lag
    EkiConfig config = eki_config();
    config.latch_delay_s = controller.lag_s;
    EkiRig rig(controller, config);
    prepare(rig);
    const CoreResult result = rig.search(3.0, cruise_s);
    ASSERT_EQ(result.outcome, MoveOutcome::kContact) << words(result);
    // The remainder is the setpoint's step of 4 ms.
    EXPECT_NEAR(result.latch->contact_rad[0] / kEkiDeg, rig.touched_deg, 0.004 * 3.0 / cruise_s);
  }
}

TEST(EkiSearch, ByFlagInterpolatesTheRecordedPathAndSaysHowSureItIs) {
  EkiRig rig(eki_controller(), by_flag());
  prepare(rig);
  rig.wired_to_input = false;
  const CoreResult result = rig.search(3.0, 6.0);
  ASSERT_EQ(result.outcome, MoveOutcome::kContact) << words(result);
  const double speed_deg_s = 0.5;
  EXPECT_GE(result.latch->time_sigma_s, 0.010);
  EXPECT_NEAR(result.latch->contact_rad[0] / kEkiDeg, rig.touched_deg,
              3 * result.latch->time_sigma_s * speed_deg_s);
  // Trip, telegram, loop, interrupt, ramp: about 60 ms.
  EXPECT_LT(rig.true_deg() - rig.touched_deg, 0.1 * speed_deg_s);
}

TEST(EkiSearch, GoesOnWhereTheControllersTimerBeginsAnew) {
  for (const auto before_search : {500ms, 1500ms, 2500ms}) {  // before, at and after the contact
    EkiRig rig(eki_controller(), by_flag());
    const TimePoint anew{std::chrono::milliseconds(std::int64_t{1} << 31)};
    rig.now = TimePoint{};
    rig.cycle();  // $TIMER starts
    rig.now = anew - 5s;
    prepare(rig);
    rig.wired_to_input = false;
    rig.run(anew - before_search - rig.now);
    const CoreResult result = rig.search(3.0, 6.0);
    ASSERT_EQ(result.outcome, MoveOutcome::kContact) << words(result);
    EXPECT_NEAR(result.latch->contact_rad[0] / kEkiDeg, rig.touched_deg, 0.015);
  }
}

TEST(EkiSearch, ByFlagIsRefusedWhereItWouldGoOnTooFar) {
  EkiRig rig(eki_controller(), by_flag());
  prepare(rig);
  const CoreResult result = rig.search(3.0, 2.0);
  EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
  ASSERT_TRUE(is<cause::TooFastForFlag>(result.cause)) << words(result);
  EXPECT_NEAR(std::get<cause::TooFastForFlag>(result.cause).speed_deg_s, 1.5, 1e-4);
}

TEST(EkiSearch, WithoutContactArrivesAndLatchesNothing) {
  EkiRig rig;
  rig.make_ready();
  const CoreResult result = rig.search(1.0, 1.0);
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived) << words(result);
  EXPECT_FALSE(result.latch.has_value());
}

TEST(EkiSearch, NoiseIsRevokedWhoeverStoppedTheArm) {
  for (const bool wired : {true, false}) {
    EkiRig rig;
    prepare(rig);
    rig.revokes = true;
    rig.wired_to_input = wired;
    const CoreResult result = rig.search(3.0, 3.0);
    EXPECT_EQ(result.outcome, MoveOutcome::kRevoked) << words(result);
    EXPECT_LT(rig.true_deg(), 1.7);
  }
}

TEST(EkiSearch, ABrokenWireToTheInputStopsOverTheNetworkAndIsNoTouch) {
  EkiRig rig;
  prepare(rig);
  rig.krc.input_broken(true, rig.now);
  const CoreResult result = rig.search(3.0, 3.0);
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
  EXPECT_TRUE(is<cause::InputMissed>(result.cause)) << words(result);
  EXPECT_LT(rig.true_deg(), 1.7);
}

TEST(EkiSearch, AnInputThatTheSensorKnowsNothingOfIsNoTouch) {
  EkiRig rig;
  prepare(rig);
  rig.seen_by_sensor = false;
  const CoreResult result = rig.search(3.0, 3.0);
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
  EXPECT_TRUE(is<cause::InputAlone>(result.cause)) << words(result);
  EXPECT_LT(rig.true_deg(), 1.6);
}

TEST(EkiSearch, AnInputThatIsOnAlreadyIsRefusedByTheController) {
  EkiRig rig;
  rig.make_ready();
  rig.krc.input(rig.now, true);
  const CoreResult result = rig.search(1.0, 1.0);
  EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
  EXPECT_TRUE(is<cause::InputAtStart>(result.cause)) << words(result);
  EXPECT_EQ(rig.krc.moves(), 0u);
}

TEST(EkiSearch, ALostSensorStopsTheArm) {
  for (const bool flag : {false, true}) {
    EkiRig rig(eki_controller(), flag ? by_flag() : eki_config());
    rig.make_ready();
    rig.guard.arm(++rig.arm_id);
    rig.begin(MoveKind::kSearch, rig.moved_by(0, 3), 6.0, rig.arm_id);
    rig.run(1s);
    const double at = rig.true_deg();
    ASSERT_FALSE(rig.krc.at_rest());
    rig.guard.set_alive(false);
    const CoreResult result = rig.finish();
    EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
    EXPECT_TRUE(is<cause::SensorDead>(result.cause)) << words(result);
    EXPECT_LT(rig.true_deg() - at, 0.1 * 0.5);
  }
}

TEST(EkiSearch, AnArmingThatEndsStopsTheArm) {
  EkiRig rig;
  rig.make_ready();
  rig.guard.arm(++rig.arm_id);
  rig.begin(MoveKind::kSearch, rig.moved_by(0, 3), 3.0, rig.arm_id);
  rig.run(500ms);
  rig.guard.disarm();
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
  EXPECT_TRUE(is<cause::ArmExpired>(result.cause)) << words(result);
}

TEST(EkiSearch, ATripThatIsNeitherConfirmedNorRevokedIsNoTouch) {
  EkiRig rig;
  rig.make_ready();
  rig.guard.arm(++rig.arm_id);
  rig.begin(MoveKind::kSearch, rig.moved_by(0, 3), 3.0, rig.arm_id);
  rig.run(500ms);
  rig.guard.trip(rig.arm_id, rig.now);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
  EXPECT_TRUE(is<cause::TripUnconfirmed>(result.cause)) << words(result);
}

TEST(EkiSearch, NeedsASensorThatIsArmedAndOpen) {
  EkiRig without(eki_controller(), eki_config(), false);
  without.make_ready();
  EXPECT_EQ(without.move(MoveKind::kSearch, without.moved_by(0, 1), 1.0, 1).outcome,
            MoveOutcome::kRefused);
  EkiRig rig;
  rig.make_ready();
  EXPECT_EQ(rig.move(MoveKind::kSearch, rig.moved_by(0, 1), 1.0, 1).outcome, MoveOutcome::kRefused);
  rig.guard.arm(1);
  rig.guard.touch(true);
  EXPECT_EQ(rig.move(MoveKind::kSearch, rig.moved_by(0, 1), 1.0, 1).outcome, MoveOutcome::kRefused);
  EXPECT_EQ(rig.krc.moves(), 0u);
}

TEST(EkiSearch, ALatchThatDoesNotFitTheMeasuredPathIsNoTouch) {
  EkiRig rig;
  prepare(rig);
  rig.mangle = [](std::string bytes) {
    const std::string latch = "<Latch ";
    for (auto at = bytes.find(latch); at != std::string::npos; at = bytes.find(latch, at + 1)) {
      const auto value = bytes.find("A1=\"", at);
      if (value != std::string::npos) bytes.insert(value + 4, bytes[value + 4] == '-' ? "" : "2");
    }
    return bytes;
  };
  const CoreResult result = rig.search(3.0, 3.0);
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
  EXPECT_TRUE(is<cause::LatchOutOfRange>(result.cause)) << words(result);
}

TEST(EkiSearch, ALatchOfAnEarlierMoveIsNotTaken) {
  EkiRig rig;
  prepare(rig);
  ASSERT_EQ(rig.search(3.0, 3.0).outcome, MoveOutcome::kContact);
  rig.wall_rad.reset();
  rig.guard.touch(false);
  rig.krc.input(rig.now, false);
  ASSERT_EQ(rig.move(MoveKind::kRetreat, rig.moved_by(0, -1), 1.0).outcome, MoveOutcome::kArrived);
  rig.guard.arm(++rig.arm_id);
  rig.begin(MoveKind::kSearch, rig.moved_by(0, 1), 2.0, rig.arm_id);
  rig.run(500ms);
  // The sensor confirms a contact not seen by the controller's input.
  rig.guard.trip(rig.arm_id, rig.now);
  rig.guard.push(ContactEventKind::kContact, rig.arm_id, rig.now);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
  EXPECT_FALSE(result.latch.has_value());
}

TEST(EkiSearch, AStampOutsideOfTheRecordIsNoTouch) {
  EkiRig rig(eki_controller(), by_flag());
  rig.make_ready();
  rig.guard.arm(++rig.arm_id);
  rig.begin(MoveKind::kSearch, rig.moved_by(0, 3), 6.0, rig.arm_id);
  rig.run(500ms);
  rig.guard.trip(rig.arm_id, rig.now - 60s);
  rig.guard.push(ContactEventKind::kContact, rig.arm_id, rig.now - 60s);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
  EXPECT_TRUE(is<cause::StampOutside>(result.cause)) << words(result);
}

TEST(EkiSearch, ALinkThatBreaksIsNeverNoContact) {
  EkiRig rig;
  prepare(rig);
  rig.guard.arm(++rig.arm_id);
  rig.begin(MoveKind::kSearch, rig.moved_by(0, 3), 3.0, rig.arm_id);
  rig.run(1s);
  rig.cable = false;
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kRobotSilent);
  EXPECT_TRUE(rig.run_until([&] { return rig.krc.at_rest(); }, 2s));
  EXPECT_LT(rig.true_deg(), 1.6) << "the wall stopped it, or the dead man";
}

TEST(EkiSearch, ATripThatIsHeardAfterTheArmHasArrivedIsStillHeard) {
  for (const bool flag : {false, true}) {
    EkiRig rig(eki_controller(), flag ? by_flag() : eki_config());
    rig.make_ready();
    rig.guard.arm(++rig.arm_id);
    rig.begin(MoveKind::kSearch, rig.moved_by(0, 1), 2.0, rig.arm_id);
    ASSERT_TRUE(rig.run_until([&] { return !rig.krc.at_rest(); }, 1s));
    ASSERT_TRUE(rig.run_until([&] { return rig.krc.at_rest(); }, 5s));
    rig.run(40ms);  // its state has arrived, and the adapter waits for rest
    rig.guard.trip(rig.arm_id, rig.now - 60ms);
    rig.run(8ms);
    rig.guard.push(ContactEventKind::kContact, rig.arm_id, rig.now - 68ms);
    const CoreResult result = rig.finish();
    EXPECT_EQ(result.outcome, flag ? MoveOutcome::kContact : MoveOutcome::kContactSilent)
        << words(result);
  }
}

TEST(EkiSearch, ASensorThatFallsSilentAfterTheArmHasArrivedHasSeenNothing) {
  for (const bool dead : {false, true}) {
    EkiRig rig;
    rig.make_ready();
    rig.guard.arm(++rig.arm_id);
    rig.begin(MoveKind::kSearch, rig.moved_by(0, 1), 2.0, rig.arm_id);
    ASSERT_TRUE(rig.run_until([&] { return !rig.krc.at_rest(); }, 1s));
    ASSERT_TRUE(rig.run_until([&] { return rig.krc.at_rest(); }, 5s));
    rig.run(40ms);
    if (dead) {
      rig.guard.set_alive(false);
    } else {
      rig.guard.disarm();
    }
    EXPECT_EQ(rig.finish().outcome, MoveOutcome::kContactSilent);
  }
}

TEST(EkiSearch, ATripBeforeItsTelegramIsOutIsNoArrival) {
  EkiConfig config = by_flag();
  config.window = 2;
  EkiRig rig(eki_controller(), config);
  rig.make_ready();
  rig.cable = false;  // nothing is confirmed
  rig.run(120ms);     // beats fill the window
  rig.guard.arm(++rig.arm_id);
  rig.begin(MoveKind::kSearch, rig.moved_by(0, 1), 2.0, rig.arm_id);
  rig.cycle();
  ASSERT_TRUE(rig.core.state().moving);
  rig.guard.trip(rig.arm_id, rig.now);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kRefused) << words(result);
  EXPECT_TRUE(is<cause::TrippedAtStart>(result.cause)) << words(result);
  EXPECT_EQ(rig.krc.moves(), 0u);
}

}  // namespace
}  // namespace cellcal::drivers
