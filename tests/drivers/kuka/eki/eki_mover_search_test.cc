// The EKI adapter's mover by itself, in a search: latch, stops, and the outcome of each end.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/drivers/kuka/eki/eki_mover_alone.h"

namespace cellcal::drivers {
namespace {

using namespace std::chrono_literals;

struct EkiMoverSearch : EkiMoverAlone {
  /// The controller's interrupt has latched the position of the arm.
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
  // The next search is unaffected.
  guard.arm(5);
  ASSERT_FALSE(begin(MoveKind::kSearch, 5.0, 10.0, 5));
  moving(3);
  arrive();
  expect(done(EkiOutcome::kArrived), MoveOutcome::kArrived, cause::None{});
}

TEST_F(EkiMoverSearch, TakesTheLatchThatTheControllerRepeats) {
  search();
  moving(20, 0.01);
  guard.trip(5, now - 4ms);
  guard.push(ContactEventKind::kContact, 5, now - 4ms);
  latched(at_deg[1] + 0.02);  // damaged
  ASSERT_FALSE(state(EkiProgress::kDone, EkiOutcome::kInput));
  latched(at_deg[1] - 0.003);
  const CoreResult result = done(EkiOutcome::kInput);
  expect(result, MoveOutcome::kContact, cause::None{});
  EXPECT_NEAR(result.latch->contact_rad[1], (at_deg[1] - 0.003) * kDeg, 1e-9);
  EXPECT_EQ(states, 9) << "after the damaged one, and not a state more";
  search();
  moving(20, 0.01);
  guard.trip(5, now - 4ms);
  guard.push(ContactEventKind::kContact, 5, now - 4ms);
  std::optional<CoreResult> torn;
  for (int i = 0; i < 200 && !torn; ++i) {
    latched(at_deg[1] - 0.003 + 0.001 * (i % 2));
    torn = state(EkiProgress::kDone, EkiOutcome::kInput);
  }
  ASSERT_TRUE(torn);
  expect(*torn, MoveOutcome::kContactSilent, cause::LatchMissing{});
}

TEST_F(EkiMoverSearch, AStopThatArrivedAsAMissingTelegramStillEndsInTheContact) {
  config.stop = EkiStop::kFlag;
  search();
  moving(20, 0.01);
  guard.trip(5, now);
  EXPECT_FALSE(tick());
  ASSERT_TRUE(mover.wants_stop());
  mover.stop_sent(now);
  guard.push(ContactEventKind::kContact, 5, now);
  expect(done(EkiOutcome::kDeadMan), MoveOutcome::kContact, cause::None{});
}

TEST_F(EkiMoverSearch, AnEndThatIsTakenBackIsNoContact) {
  config.stop = EkiStop::kFlag;
  search();
  ASSERT_FALSE(state(EkiProgress::kDone, EkiOutcome::kArrived));
  guard.trip(5, now);
  guard.push(ContactEventKind::kContact, 5, now);
  EXPECT_FALSE(tick());
  moving();
  EXPECT_TRUE(mover.wants_stop());
  mover.stop_sent(now);
  expect(done(EkiOutcome::kStop), MoveOutcome::kNotFollowing, cause::EndWithdrawn{});
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
  search();  // without a message of the sensor
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
  // Counted from the end of the motion, and reported from the trip.
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
             cause::LatchOutOfRange{1, path_deg + beside_deg, path_deg}, 1e-4);
    }
  }
}

}  // namespace
}  // namespace cellcal::drivers
