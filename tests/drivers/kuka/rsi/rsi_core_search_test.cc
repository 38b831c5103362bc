#include <random>

#include "tests/drivers/kuka/rsi/rig.h"

namespace cellcal::drivers {
namespace {

constexpr double kSearchDeg = 2.0;
constexpr double kSearchS = 10.0;  // 0.2 deg/s: 5 mm/s at 1.4 m

/// Ready, armed, and one second into a search on A1.
class Search : public ::testing::Test {
 protected:
  Search() : Search(sim::ControllerConfig{}) {}
  explicit Search(const sim::ControllerConfig& krc) : rig(krc) {}

  void search(Duration into = 1s) {
    rig.make_ready();
    rig.guard.arm(kArm);
    rig.begin(MoveKind::kSearch, rig.moved_by(0, kSearchDeg), kSearchS, kArm);
    rig.run(into);
    ASSERT_TRUE(rig.core.state().moving);
  }
  void expect_still(const AxisAngles& at) {
    rig.run(300ms);
    EXPECT_EQ(rig.commanded(), at);
  }

  Rig rig;
};

TEST_F(Search, TripFreezesTheVeryReplyAndContactLatches) {
  search();
  rig.network_delay = [] { return Duration(50us); };
  const AxisAngles before = rig.commanded();
  const std::string last_reply = rig.reply;
  const TimePoint edge = rig.now + 1500us;
  const std::vector<double> truth = rig.krc.actual_rad_at(edge);
  rig.guard.trip(kArm, edge);
  rig.cycle();
  EXPECT_EQ(rig.commanded(), before) << "not one step more";
  EXPECT_EQ(rig.reply.substr(0, rig.reply.find("<IPOC>")),
            last_reply.substr(0, last_reply.find("<IPOC>")));
  rig.run(20ms);
  rig.guard.push(ContactEventKind::kContact, kArm, edge, 3);
  rig.guard.touch(true);
  const CoreResult result = rig.finish();
  ASSERT_EQ(result.outcome, MoveOutcome::kContact) << words(result);
  EXPECT_EQ(result.at_rad, before);
  ASSERT_TRUE(result.latch);
  EXPECT_EQ(result.latch->contact_time, edge);
  EXPECT_EQ(result.latch->bounces, 3);
  // The sensor's 20 us, and the 50 us by which the network became faster meanwhile.
  EXPECT_NEAR(result.latch->time_sigma_s, 54e-6, 2e-6);
  EXPECT_NEAR(result.latch->reaction_s, 2.55e-3, 1e-6);
  for (std::size_t i = 0; i < 6; ++i) {
    // Four transmitted decimals, and 0.2 deg/s times the smallest delay of 50 us.
    EXPECT_NEAR(result.latch->contact_rad[i], truth[i], 1.2e-4 * kDeg) << i;
    EXPECT_NEAR(result.latch->settled_rad[i], before[i], 3e-4 * kDeg) << i;
  }
  EXPECT_GT(result.latch->settled_rad[0] - result.latch->contact_rad[0], 0.002 * kDeg)
      << "the arm lags, so it goes on a little after the contact";
  expect_still(before);
}

TEST_F(Search, RetreatBeginsOnceTheControllerHasTakenTheStop) {
  rig.make_ready();
  rig.guard.arm(kArm);
  rig.begin(MoveKind::kSearch, rig.moved_by(0, 20), 1.0, kArm);
  rig.run(500ms);  // far above probing speed: the stop is a brake
  rig.guard.trip(kArm, rig.now);
  rig.run(8ms);
  rig.to_krc = false;
  rig.guard.push(ContactEventKind::kContact, kArm, rig.now - 8ms);
  const CoreResult contact = rig.finish();
  ASSERT_EQ(contact.outcome, MoveOutcome::kContact) << words(contact);
  rig.begin(MoveKind::kRetreat, rig.moved_by(0, -5));
  rig.cycle();
  EXPECT_EQ(rig.commanded(), contact.at_rad);
  rig.to_krc = true;
  const CoreResult retreat = rig.finish();
  EXPECT_EQ(retreat.outcome, MoveOutcome::kArrived) << words(retreat);
}

TEST_F(Search, RetreatThatWaitsForRepliesToBeTakenEndsByTheLimitOfLateOnes) {
  search();
  rig.guard.trip(kArm, rig.now);
  rig.guard.push(ContactEventKind::kContact, kArm, rig.now);
  rig.finish();
  bool taken = false;
  rig.after_cycle = [&] { rig.to_krc = taken = !taken; };
  rig.run(20ms);
  rig.begin(MoveKind::kRetreat, rig.moved_by(0, -1));
  const CoreResult retreat = rig.finish(100ms);
  EXPECT_EQ(retreat.outcome, MoveOutcome::kRobotSilent) << words(retreat);
  EXPECT_TRUE(is<cause::LateReplies>(retreat.cause)) << words(retreat);
}

TEST_F(Search, LatchDoesNotMindNetworkJitter) {
  std::mt19937 random(4);
  std::exponential_distribution<double> jitter(1.0 / 400e-6);
  rig.network_delay = [&] {
    return Duration(50us) + std::chrono::duration_cast<Duration>(
                                std::chrono::duration<double>(std::min(jitter(random), 3e-3)));
  };
  search(3s);
  const TimePoint edge = rig.now + 1700us;
  const double truth = rig.krc.actual_rad_at(edge)[0];
  rig.guard.trip(kArm, edge);
  rig.guard.push(ContactEventKind::kContact, kArm, edge);
  const CoreResult result = rig.finish();
  ASSERT_EQ(result.outcome, MoveOutcome::kContact) << words(result);
  EXPECT_NEAR(result.latch->contact_rad[0], truth, 1.5e-4 * kDeg);
}

TEST_F(Search, AnAngleBesideEverythingCommandedIsNoContactPosition) {
  search();
  const TimePoint edge = rig.now + 1500us;
  // The packet after the contact has one digit changed: A1 is a degree off.
  rig.before_core = [&] {
    const std::size_t a1 = rig.packet.find("<AIPos A1=\"");
    ASSERT_NE(a1, std::string::npos);
    rig.packet.insert(a1 + std::string_view("<AIPos A1=\"").size(), "1");
    rig.before_core = nullptr;
  };
  rig.guard.trip(kArm, edge);
  rig.cycle();
  rig.guard.push(ContactEventKind::kContact, kArm, edge, 0);
  rig.guard.touch(true);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing) << words(result);
  EXPECT_FALSE(result.latch);
}

TEST_F(Search, TripThatWasNoiseIsRevoked) {
  search();
  const AxisAngles before = rig.commanded();
  rig.guard.trip(kArm, rig.now);
  rig.run(30ms);
  rig.guard.push(ContactEventKind::kRevoked, kArm, rig.now);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kRevoked);
  EXPECT_FALSE(result.latch);
  expect_still(before);
}

TEST_F(Search, TripWithoutVerdictIsASilentSensorNotAContact) {
  search();
  const AxisAngles before = rig.commanded();
  rig.guard.trip(kArm, rig.now);
  const CoreResult result = rig.finish(1s);
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
  EXPECT_TRUE(is<cause::TripUnconfirmed>(result.cause)) << words(result);
  expect_still(before);
}

TEST_F(Search, DeadSensorFreezesInThatCycle) {
  search();
  const AxisAngles before = rig.commanded();
  rig.guard.set_alive(false);
  rig.cycle();
  EXPECT_EQ(rig.commanded(), before);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
  EXPECT_TRUE(is<cause::SensorDead>(result.cause)) << words(result);
  expect_still(before);
}

TEST_F(Search, SensorThatDiesBetweenTripAndVerdictIsSilent) {
  search();
  rig.guard.trip(kArm, rig.now);
  rig.run(8ms);
  rig.guard.set_alive(false);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kContactSilent);
}

TEST_F(Search, ArmingThatExpiresFreezes) {
  search();
  const AxisAngles before = rig.commanded();
  rig.guard.disarm();
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
  EXPECT_TRUE(is<cause::ArmExpired>(result.cause)) << words(result);
  expect_still(before);
}

TEST_F(Search, HeartbeatsThatThisComputerDeliveredLateAreToldFromASilentSensor) {
  search();
  const AxisAngles before = rig.commanded();
  rig.guard.end_arming(ArmEnd::kSilence);
  rig.cycle();
  EXPECT_EQ(rig.commanded(), before) << "whoever is to blame";
  rig.guard.set_delivered_late(0.040, 0.025);  // while the arm comes to rest
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
  expect_cause(result.cause, cause::SensorLate{0.040, 0.025});
  EXPECT_EQ(result.interruption, Interruption::kLateBytes);
}

TEST_F(Search, AnArmingThatEndedBySilenceIsNotSaidToHaveExpired) {
  search();
  rig.guard.end_arming(ArmEnd::kSilence);
  const CoreResult result = rig.finish();
  EXPECT_TRUE(is<cause::SensorDead>(result.cause)) << words(result);
}

TEST_F(Search, ASensorThatMissedThisComputersKeepAliveSaysSo) {
  search();
  rig.guard.end_arming(ArmEnd::kSensorDisarmed);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
  EXPECT_TRUE(is<cause::KeepAliveLate>(result.cause)) << words(result);
  EXPECT_EQ(result.interruption, Interruption::kLateBytes);
}

TEST_F(Search, ContactLevelWithoutATripFreezesAndAwaitsTheVerdict) {
  search();
  const AxisAngles before = rig.commanded();
  rig.guard.touch(true);
  rig.cycle();
  EXPECT_EQ(rig.commanded(), before);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kContactSilent);
}

TEST_F(Search, DamagedPacketDoesNotHideTheTrip) {
  search();
  const AxisAngles before = rig.commanded();
  rig.guard.trip(kArm, rig.now);
  rig.before_core = [&] { rig.packet.replace(rig.packet.find("<AIPos"), 6, "<<<<<<"); };
  rig.cycle();
  rig.before_core = {};
  rig.guard.push(ContactEventKind::kContact, kArm, rig.now - 4ms);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kContact) << words(result);
  EXPECT_EQ(result.at_rad, before);
}

TEST_F(Search, EndOfTravelWithoutContactHasArrived) {
  rig.make_ready();
  rig.guard.arm(kArm);
  const AxisAngles target = rig.moved_by(0, 0.5);
  const CoreResult result = rig.move(MoveKind::kSearch, target, 1.0, kArm);
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived);
  EXPECT_EQ(result.at_rad, target);
  EXPECT_FALSE(result.latch);
}

TEST_F(Search, ContactWhileTheArmCatchesUpAtTheEndCounts) {
  search(1s);
  const auto target = rig.moved_by(0, 0);
  // Run to the last commanded step; the lagging arm is still moving.
  AxisAngles previous = target;
  rig.run_until([&] {
    const bool done = rig.commanded() == previous;
    previous = rig.commanded();
    return done;
  });
  const TimePoint edge = rig.now;
  rig.guard.trip(kArm, edge);
  rig.guard.push(ContactEventKind::kContact, kArm, edge);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kContact);
}

TEST_F(Search, StopInASearchFreezes) {
  search();
  const AxisAngles before = rig.commanded();
  rig.core.stop();
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kStopped);
  EXPECT_EQ(result.at_rad, before);
}

TEST_F(Search, AtProbingSpeedEveryStopIsAFreeze) {
  rig.make_ready();
  rig.guard.arm(kArm);
  rig.begin(MoveKind::kSearch, rig.moved_by(0, 6), 3.0, kArm);  // 2 deg/s, the limit
  rig.run(1s);
  const AxisAngles before = rig.commanded();
  rig.guard.trip(kArm, rig.now);
  rig.guard.push(ContactEventKind::kContact, kArm, rig.now);
  EXPECT_EQ(rig.finish().at_rad, before);
}

/// Setpoints of A1 [rad] from now to the end of the move.
std::vector<double> follow_a1(Rig& rig, CoreResult& result) {
  std::vector<double> at{rig.krc.setpoint_rad()[0]};
  rig.after_cycle = [&] { at.push_back(rig.krc.setpoint_rad()[0]); };
  result = rig.finish();
  rig.after_cycle = {};
  return at;
}

TEST_F(Search, AboveItTheRampBeginsInTheVeryReplyAndEndsWithinAFewCycles) {
  for (const int stop : {0, 1, 2}) {
    Rig fast;
    fast.make_ready();
    fast.guard.arm(kArm);
    fast.begin(MoveKind::kSearch, fast.moved_by(0, 30), 3.0, kArm);  // 10 deg/s
    fast.run(1s);
    const AxisAngles before = fast.commanded();
    const TimePoint edge = fast.now - 300us;
    const double truth = fast.krc.actual_rad_at(fast.now)[0] - 10 * kDeg * 300e-6;
    if (stop == 0) fast.guard.trip(kArm, edge);
    if (stop == 0) fast.guard.push(ContactEventKind::kContact, kArm, edge);
    if (stop == 1) fast.guard.set_alive(false);
    if (stop == 2) fast.core.stop();
    CoreResult result;
    const std::vector<double> at = follow_a1(fast, result);
    // The active command at the trip was the last full step.
    const double full = 10 * kDeg * 0.004;
    std::size_t steps = 0;
    double last = full + 2e-6 * kDeg;
    for (std::size_t i = 2; i < at.size(); ++i) {
      const double step = at[i] - at[i - 1];
      EXPECT_LE(step, last) << "slower from reply to reply";
      EXPECT_GE(step, -1e-9);
      steps += step > 1e-7 * kDeg;
      last = step + 2e-6 * kDeg;
    }
    EXPECT_GE(steps, 2U) << "no step in speed";
    EXPECT_LE(steps, 5U) << "20 ms";
    EXPECT_LT(at[2] - at[1], full) << "the very reply";
    EXPECT_LE(result.at_rad[0] - before[0], 0.5 * 10 * kDeg * 0.020 + 1e-6);
    if (stop == 0) {
      ASSERT_EQ(result.outcome, MoveOutcome::kContact) << words(result);
      EXPECT_NEAR(result.latch->contact_rad[0], truth, 10 * kDeg * 150e-6) << "not the ramp's end";
      EXPECT_NEAR(result.latch->settled_rad[0], result.at_rad[0], 1e-3 * kDeg);
    } else if (stop == 1) {
      EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
    } else {
      EXPECT_EQ(result.outcome, MoveOutcome::kStopped);
    }
  }
}

TEST_F(Search, TimeStampOutsideOfTheRecordIsNotAContact) {
  search();
  rig.guard.trip(kArm, rig.now);
  rig.guard.push(ContactEventKind::kContact, kArm, rig.now - 60s);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
  EXPECT_TRUE(is<cause::StampOutside>(result.cause)) << words(result);
  EXPECT_FALSE(result.latch);
}

TEST_F(Search, SilenceOfTheRobotAfterATripIsNoContact) {
  search();
  rig.guard.trip(kArm, rig.now);
  rig.run(8ms);
  rig.to_pc = false;
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kRobotSilent);
  EXPECT_FALSE(result.latch);
}

TEST_F(Search, IsRefusedUnlessTheSensorGuardsIt) {
  rig.make_ready();
  const AxisAngles before = rig.commanded();
  const auto attempt = [&] {
    const CoreResult result = rig.move(MoveKind::kSearch, rig.moved_by(0, 1), 5.0, kArm);
    EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
    EXPECT_EQ(rig.commanded(), before);
    return result.cause;
  };
  expect_cause(attempt(), cause::NotArmed{kArm});
  rig.guard.arm(kArm + 1);
  expect_cause(attempt(), cause::ArmedOtherwise{kArm, kArm + 1});
  rig.guard.arm(kArm);
  rig.guard.touch(true);
  expect_cause(attempt(), cause::TouchingAtStart{});
  rig.guard.touch(false);
  rig.guard.set_alive(false);
  expect_cause(attempt(), cause::SensorDead{});
  rig.guard.set_alive(true);
  rig.guard.push(ContactEventKind::kTrip, kArm, rig.now);  // with the level still armed
  rig.run(20ms);
  expect_cause(attempt(), cause::TrippedAtStart{});
}

TEST(SearchWithoutSensor, IsRefusedButTransitGoes) {
  Rig rig({}, rig_config(), false);
  rig.make_ready();
  expect_cause(rig.move(MoveKind::kSearch, rig.moved_by(0, 1), 5.0, kArm).cause, cause::NoSensor{});
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kArrived);
}

class Guarded : public Search {};

TEST_F(Guarded, ContactInTransitStopsOnTheRamp) {
  rig.make_ready();
  const AxisAngles target = rig.moved_by(0, 60);
  rig.begin(MoveKind::kTransit, target);
  rig.run(400ms);
  const AxisAngles before = rig.commanded();
  rig.guard.touch(true);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kUnexpectedContact);
  EXPECT_GT(result.at_rad[0], before[0]);
  EXPECT_LT(result.at_rad[0] - before[0], 25 * kDeg);
}

TEST_F(Guarded, UnarmedTripStopsATransit) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 60));
  rig.run(400ms);
  rig.guard.push(ContactEventKind::kTrip, 99, rig.now);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kUnexpectedContact);
}

TEST_F(Guarded, TouchTooShortForTheLevelStopsATransit) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 60));
  rig.run(400ms);
  rig.guard.push(ContactEventKind::kContact, 0, rig.now);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kUnexpectedContact);
}

TEST_F(Guarded, TransitDoesNotBeginInContactOrUnwatched) {
  rig.make_ready();
  const AxisAngles before = rig.commanded();
  rig.guard.touch(true);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 5)).outcome,
            MoveOutcome::kUnexpectedContact);
  rig.guard.touch(false);
  rig.guard.set_alive(false);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 5)).outcome, MoveOutcome::kContactSilent);
  EXPECT_EQ(rig.commanded(), before);
}

TEST_F(Guarded, SensorThatDiesInTransitStopsIt) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 60));
  rig.run(400ms);
  rig.guard.set_alive(false);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kContactSilent);
}

TEST_F(Guarded, RetreatBeginsInContactAndEndsOpen) {
  rig.make_ready();
  rig.guard.touch(true);
  rig.begin(MoveKind::kRetreat, rig.moved_by(0, -2), 1.0);
  rig.run(100ms);
  rig.guard.touch(false);
  rig.run(8ms);
  rig.guard.touch(true);  // chatter of the opening contact
  rig.run(8ms);
  rig.guard.touch(false);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kArrived);
}

TEST_F(Guarded, RetreatThatDoesNotOpenSaysSo) {
  rig.make_ready();
  rig.guard.touch(true);
  const CoreResult result = rig.move(MoveKind::kRetreat, rig.moved_by(0, -2), 1.0);
  EXPECT_EQ(result.outcome, MoveOutcome::kStillInContact);
  expect_cause(result.cause, cause::ContactNotOpen{});
}

TEST_F(Guarded, RetreatThatTouchesAgainStops) {
  rig.make_ready();
  rig.guard.touch(true);
  rig.begin(MoveKind::kRetreat, rig.moved_by(0, -2), 1.0);
  rig.run(100ms);
  rig.guard.touch(false);
  rig.run(200ms);
  rig.guard.touch(true);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kUnexpectedContact);
}

}  // namespace
}  // namespace cellcal::drivers
