// An arming from its request to its end, with a scripted sensor.

#include "scripted_sensor.h"

namespace cellcal::drivers {
namespace {

using namespace std::chrono_literals;

struct CoreArming : testing::Test {
  CoreArming() { EXPECT_TRUE(s.get_ready()); }
  void touch(bool touching) {
    s.set(CTP_FLAG_CONTACT, touching);
    s.say_status();
  }
  ctp::Event event(std::uint16_t number, std::uint16_t arm_id, TimePoint edge,
                   std::uint8_t bounces = 0) {
    return {number, arm_id, s.ticks(edge), 500, bounces, 1, 700};
  }
  double silent_ms() { return 1e3 * s.facts().silent_s; }
  ScriptedSensor s;
};

TEST_F(CoreArming, WhatTheSensorSaysAgainstItIsTheAnswer) {
  const std::pair<std::uint8_t, ArmRefusal> reasons[] = {
      {CTP_NAK_IN_CONTACT, ArmRefusal::kInContact},
      {CTP_NAK_LOOP_BROKEN, ArmRefusal::kLoopBroken},
      {CTP_NAK_VOLTAGE_UNDEFINED, ArmRefusal::kVoltageUndefined},
      {CTP_NAK_SELF_TEST_OLD, ArmRefusal::kSelfTestOld},
      {CTP_NAK_BAD_ARGUMENT, ArmRefusal::kBadArgument},
      {CTP_NAK_BAD_VERSION, ArmRefusal::kBadVersion},
      {99, ArmRefusal::kUnknownReason}};
  std::uint16_t id = 0;
  for (const auto& [reason, refusal] : reasons) {
    s.nak_arm = reason;
    EXPECT_EQ(s.refusal(++id, 1s), refusal);
    EXPECT_FALSE(s.facts().armed);
  }
  s.nak_arm = 0;
  EXPECT_TRUE(s.arm(++id, 1s));
  // Once armed, later NAKs are not refusals.
  s.say(ctp::Nak{CTP_ARM, CTP_NAK_IN_CONTACT});
  EXPECT_FALSE(s.core.poll_arm());
  EXPECT_TRUE(s.facts().armed);
}

TEST_F(CoreArming, ARefusalOfAnotherRequestIsNoAnswer) {
  s.arms = false;
  s.core.arm(4, 1s, s.now);
  s.say(ctp::Nak{CTP_PING, CTP_NAK_IN_CONTACT});
  EXPECT_FALSE(s.core.poll_arm());
}

TEST_F(CoreArming, WhatTheHostKnowsAgainstItIsNotAskedAtAll) {
  EXPECT_EQ(s.refusal(0, 1s), ArmRefusal::kBadArgument);
  EXPECT_EQ(s.refusal(1, 0ms), ArmRefusal::kBadArgument);
  EXPECT_EQ(s.refusal(1, -1ms), ArmRefusal::kBadArgument);
  EXPECT_EQ(s.refusal(1, 65536ms), ArmRefusal::kBadArgument);
  s.set(CTP_FLAG_LOOP_OK, false);
  s.say_status();
  EXPECT_EQ(s.refusal(1, 1s), ArmRefusal::kNotReady) << "a broken loop is a fault by itself";
  s.set(CTP_FLAG_LOOP_OK, true);
  ASSERT_TRUE(s.run_until([&] { return s.facts().step == ContactStep::kReady; }));
  touch(true);
  EXPECT_EQ(s.refusal(1, 1s), ArmRefusal::kInContact);
  touch(false);
  for (const int undefined_mv : {1001, 3499}) {
    s.status.sense_mv = static_cast<std::uint16_t>(undefined_mv);
    s.say_status();
    EXPECT_EQ(s.refusal(1, 1s), ArmRefusal::kVoltageUndefined);
  }
  EXPECT_EQ(s.count(CTP_ARM), 0u);
  for (const int defined_mv : {1000, 3500}) {
    s.status.sense_mv = static_cast<std::uint16_t>(defined_mv);
    s.say_status();
    EXPECT_TRUE(s.arm(1, 65535ms));
    s.core.disarm(s.now);
    s.run(20ms);
  }
}

TEST_F(CoreArming, ASelfTestThatIsLostIsRepeatedBeforeAnythingIsArmed) {
  s.set(CTP_FLAG_SELF_TEST_OK, false);
  s.tests = false;
  s.say_status();
  EXPECT_FALSE(s.facts().self_test_ok);
  EXPECT_EQ(s.facts().step, ContactStep::kReady);
  EXPECT_EQ(s.refusal(1, 1s), ArmRefusal::kNotReady);
  EXPECT_EQ(s.facts().fault, ContactFault::kSelfTestFailed);
  EXPECT_EQ(s.count(CTP_ARM), 0u);
}

TEST_F(CoreArming, WithoutFreshSamplesTheClockIsNotTrusted) {
  s.pongs = false;
  s.run(2500ms);
  EXPECT_TRUE(s.arm(1, 1s));
  s.core.disarm(s.now);
  s.run(1000ms);
  EXPECT_EQ(s.refusal(2, 1s), ArmRefusal::kClockNotSynchronised);
  s.pongs = true;
  s.run(1s);
  EXPECT_TRUE(s.arm(3, 1s));
}

TEST_F(CoreArming, AsksAgainWhileThereIsNoAnswerAndGivesUpBeforeTheSensorLapses) {
  s.arms = s.disarms = false;
  const TimePoint asked = s.now;
  EXPECT_EQ(s.refusal(5, 1000ms), ArmRefusal::kNoAnswer);
  const double took = std::chrono::duration<double, std::milli>(s.now - asked).count();
  EXPECT_GT(took, 80.0);
  EXPECT_LT(took, 100.0 + 30.0);
  const auto tries = s.times(CTP_ARM);
  EXPECT_GE(tries.size(), 4u);
  // 20 ms and eight of the longest frames at 1 Mbaud.
  const double answer_ms = 20.0 + 8.0 * int{CTP_MAX_WIRE} * int{CTP_BITS_PER_BYTE} / 1000.0;
  for (const double gap : gaps_ms(tries)) EXPECT_NEAR(gap, answer_ms, 0.3);
  for (const auto& sent : s.sent) {
    if (sent.frame.type != CTP_ARM) continue;
    EXPECT_EQ(ctp::read<ctp::Arm>(sent.frame).arm_id, 5);
    EXPECT_EQ(ctp::read<ctp::Arm>(sent.frame).lifetime_ms, 1000);
  }
  // And disarms it, until it reports being disarmed.
  s.sent.clear();
  s.set(CTP_FLAG_ARMED, true);
  s.run(200ms);
  const auto disarms = s.times(CTP_DISARM);
  EXPECT_GE(disarms.size(), 5u);
  for (const double gap : gaps_ms(disarms)) EXPECT_NEAR(gap, answer_ms, 0.3);
  EXPECT_EQ(ctp::read<ctp::Disarm>(s.sent.back().frame).arm_id, 5);
  EXPECT_FALSE(s.facts().armed);
  s.disarms = true;
  s.run(50ms);
  s.sent.clear();
  s.run(100ms);
  EXPECT_EQ(s.count(CTP_DISARM), 0u);
}

TEST_F(CoreArming, WhileArmedItSaysThatItLivesEveryTenMilliseconds) {
  ASSERT_TRUE(s.arm(5, 1000ms));
  EXPECT_TRUE(s.facts().armed);
  EXPECT_EQ(s.facts().arm_id, 5);
  EXPECT_EQ(s.facts().last_arm_end, ArmEnd::kNone);
  EXPECT_EQ(s.snapshot().arm_id, 5);
  s.sent.clear();
  s.run(300ms);
  expect_every(s.times(CTP_KEEPALIVE), 10, 28);
  s.core.disarm(s.now);
  s.sent.clear();
  EXPECT_EQ(s.facts().arm_id, 0);
  EXPECT_EQ(s.snapshot().arm_id, 0);
  EXPECT_EQ(s.facts().last_arm_end, ArmEnd::kDisarmed);
  s.run(100ms);
  EXPECT_EQ(s.count(CTP_KEEPALIVE), 0u);
}

TEST_F(CoreArming, EndsByTheHostATenthOfASecondAfterItsLifetime) {
  ASSERT_TRUE(s.arm(5, 400ms));
  const TimePoint armed = s.now;
  ASSERT_TRUE(s.run_until([&] { return !s.facts().armed; }));
  EXPECT_NEAR(std::chrono::duration<double>(s.now - armed).count(), 0.5, 1e-3);
  EXPECT_EQ(s.facts().last_arm_end, ArmEnd::kExpired);
  EXPECT_EQ(s.count(CTP_DISARM), 1u);
}

TEST_F(CoreArming, EndsByTheSensorAsExpiredOrAsItsOwnDoing) {
  for (const bool in_time : {true, false}) {
    ASSERT_TRUE(s.arm(5, 400ms));
    s.run(in_time ? 299ms : 301ms);  // the sensor's clock may be fast
    s.set(CTP_FLAG_ARMED, false);
    s.say_status();
    EXPECT_FALSE(s.facts().armed);
    EXPECT_EQ(s.facts().last_arm_end, in_time ? ArmEnd::kSensorDisarmed : ArmEnd::kExpired);
  }
  ASSERT_TRUE(s.arm(6, 400ms));
  s.set(CTP_FLAG_ARMED, false);
  s.set(CTP_FLAG_LATCHED, true);  // its trip was damaged on the line
  s.say_status();
  EXPECT_EQ(s.facts().last_arm_end, ArmEnd::kTripped);
  EXPECT_EQ(s.count(CTP_DISARM), 0u) << "nothing is left to disarm";
}

TEST_F(CoreArming, SilenceOfMoreThan25MillisecondsEndsIt) {
  ASSERT_TRUE(s.arm(5, 1000ms));
  s.run(100ms);
  s.beats = s.pongs = false;
  const TimePoint last = s.now - std::chrono::duration_cast<Duration>(
                                     std::chrono::duration<double>(s.facts().silent_s));
  EXPECT_TRUE(s.core.snapshot(last + 25ms).alive);
  EXPECT_FALSE(s.core.snapshot(last + 25ms + 1ns).alive);
  s.core.on_tick(last + 25ms);
  EXPECT_TRUE(s.facts().armed);
  s.sent.clear();
  ASSERT_TRUE(s.run_until([&] { return !s.facts().armed; }));
  EXPECT_LE(silent_ms(), 26.5);
  EXPECT_EQ(s.facts().last_arm_end, ArmEnd::kSilence);
  EXPECT_EQ(s.count(CTP_DISARM), 1u);
}

TEST_F(CoreArming, AnArmingThatNobodyAskedForIsUndone) {
  s.set(CTP_FLAG_ARMED, true);
  s.say_status();
  EXPECT_EQ(s.count(CTP_DISARM), 1u);
  EXPECT_FALSE(s.facts().armed);
}

TEST_F(CoreArming, OneAtATimeAndTheNextReplacesIt) {
  s.arms = false;
  s.core.arm(5, 1000ms, s.now);
  EXPECT_EQ(s.refusal(6, 1s), ArmRefusal::kBusy);
  s.arms = true;
  ASSERT_TRUE(s.run_until([&] { return s.facts().armed; }));
  s.core.poll_arm();
  s.core.arm(7, 1s, s.now);
  EXPECT_FALSE(s.facts().armed);
  EXPECT_EQ(s.facts().last_arm_end, ArmEnd::kDisarmed);
  ASSERT_TRUE(s.run_until([&] { return s.facts().armed; }));
  EXPECT_EQ(s.facts().arm_id, 7);
  EXPECT_EQ(s.facts().last_arm_end, ArmEnd::kNone) << "nothing is said of it by the one before";
  EXPECT_EQ(s.count(CTP_DISARM), 1u);
}

TEST_F(CoreArming, WithdrawnBeforeItsAnswerItIsAnsweredSo) {
  s.arms = false;
  s.core.arm(5, 1000ms, s.now);
  ASSERT_TRUE(s.run_until([&] { return s.count(CTP_ARM) == 1; })) << "behind its self-test";
  s.core.disarm(s.now);
  auto answer = s.core.poll_arm();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->refusal, ArmRefusal::kWithdrawn);
  EXPECT_EQ(answer->arm_id, 5);
  EXPECT_EQ(s.count(CTP_DISARM), 1u);
  s.run(50ms);
  // One that waits for the self-test is withdrawn without having been sent.
  s.arms = true;
  s.sent.clear();
  s.core.self_test(s.now);
  s.core.arm(6, 1000ms, s.now);
  s.core.disarm(s.now);
  answer = s.core.poll_arm();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->refusal, ArmRefusal::kWithdrawn);
  EXPECT_EQ(answer->arm_id, 6);
  EXPECT_FALSE(s.core.poll_arm());
  EXPECT_EQ(s.count(CTP_DISARM) + s.count(CTP_ARM), 0u);
}

TEST_F(CoreArming, WaitsForASelfTestThatRuns) {
  s.core.self_test(s.now);
  s.sent.clear();
  s.core.arm(6, 1000ms, s.now);
  EXPECT_FALSE(s.facts().armed);
  EXPECT_EQ(s.count(CTP_ARM), 0u);
  ASSERT_TRUE(s.run_until([&] { return s.facts().armed; }));
  EXPECT_EQ(s.core.poll_arm()->refusal, ArmRefusal::kNone);
}

TEST_F(CoreArming, ALostLinkAnswersWhoeverWaits) {
  s.arms = false;
  s.core.arm(5, 1000ms, s.now);
  s.core.disconnect(s.now);
  auto answer = s.core.poll_arm();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->refusal, ArmRefusal::kLinkLost);
  EXPECT_EQ(answer->arm_id, 5);
  EXPECT_FALSE(s.core.poll_arm());
}

TEST_F(CoreArming, ATripUsesItUpAndOfAnotherArmingDoesNot) {
  ASSERT_TRUE(s.arm(5, 1000ms));
  s.say(ctp::Trip{4, s.ticks(s.now)});
  EXPECT_TRUE(s.facts().armed);
  s.say(ctp::Trip{5, s.ticks(s.now)});
  EXPECT_FALSE(s.facts().armed);
  EXPECT_EQ(s.facts().last_arm_end, ArmEnd::kTripped);
  s.set(CTP_FLAG_ARMED, false);
  s.run(20ms);
  ASSERT_EQ(s.events.size(), 2u);
  EXPECT_EQ(s.events[1].kind, ContactEventKind::kTrip);
  EXPECT_EQ(s.events[1].arm_id, 5);
  EXPECT_EQ(s.events[1].bounces, 0);
}

TEST_F(CoreArming, ATripBeforeItsAnswerIsTheAnswer) {
  s.arms = false;
  s.core.arm(5, 1000ms, s.now);
  ASSERT_TRUE(s.run_until([&] { return s.count(CTP_ARM) == 1; })) << "behind its self-test";
  s.say(ctp::Trip{5, s.ticks(s.now)});
  const auto answer = s.core.poll_arm();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->refusal, ArmRefusal::kTrippedAtOnce);
  EXPECT_EQ(s.facts().last_arm_end, ArmEnd::kTripped);
  EXPECT_FALSE(s.facts().armed);
  // It is not requested again.
  s.run(200ms);
  EXPECT_EQ(s.count(CTP_ARM), 1u);
  EXPECT_FALSE(s.core.poll_arm());
}

TEST_F(CoreArming, EventsAreAcknowledgedEachTimeAndToldOnce) {
  ASSERT_TRUE(s.arm(5, 1000ms));
  s.sent.clear();
  const TimePoint edge = s.now - 2ms;
  for (int i = 0; i < 3; ++i) s.say(event(9, 5, edge, 4), CTP_CONTACT);
  EXPECT_EQ(s.count(CTP_ACK), 3u);
  EXPECT_EQ(ctp::read<ctp::Ack>(s.sent[0].frame).event, 9);
  EXPECT_FALSE(s.facts().armed) << "used up";
  EXPECT_TRUE(s.snapshot().in_contact);
  EXPECT_NEAR(s.facts().quality.contact_voltage_v, 0.7, 1e-9);
  EXPECT_EQ(s.facts().quality.bounces, 4u);
  s.set(CTP_FLAG_ARMED, false);
  s.set(CTP_FLAG_CONTACT, true);
  s.run(5ms);
  ASSERT_EQ(s.events.size(), 1u);
  EXPECT_EQ(s.events[0].kind, ContactEventKind::kContact);
  EXPECT_EQ(s.events[0].arm_id, 5);
  EXPECT_EQ(s.events[0].bounces, 4);
  EXPECT_LT(std::abs((s.events[0].first_edge - edge).count()), 2000) << "ns";
  EXPECT_LT(s.events[0].time_sigma_s, 200e-6);
  s.set(CTP_FLAG_CONTACT, false);
  s.say(event(10, 5, s.now, 1), CTP_RELEASE);
  EXPECT_FALSE(s.snapshot().in_contact);
  EXPECT_EQ(s.facts().quality.bounces, 5u);
  s.say(event(11, 0, s.now), CTP_REVOKED);
  EXPECT_FALSE(s.snapshot().in_contact);
  s.run(5ms);
  ASSERT_EQ(s.events.size(), 3u);
  EXPECT_EQ(s.events[1].kind, ContactEventKind::kRelease);
  EXPECT_EQ(s.events[2].kind, ContactEventKind::kRevoked);
}

TEST_F(CoreArming, AnEventRepeatedAfterANewerOneDoesNotChangeTheLevel) {
  s.beats = false;
  s.say(event(3, 0, s.now - 1ms), CTP_CONTACT);
  s.say(event(2, 0, s.now - 3ms), CTP_RELEASE);
  EXPECT_TRUE(s.snapshot().in_contact);
  s.status.last_event = 5;  // the frame of event 5 was lost
  s.set(CTP_FLAG_CONTACT, false);
  s.say_status();
  s.say(event(4, 0, s.now - 2ms), CTP_CONTACT);
  EXPECT_FALSE(s.snapshot().in_contact);
  s.say(event(6, 0, s.now), CTP_CONTACT);
  EXPECT_TRUE(s.snapshot().in_contact);
  s.run(5ms);
  EXPECT_EQ(s.events.size(), 4u) << "each is delivered";
}

TEST_F(CoreArming, ARevokedTouchUsesItUpAndAReleaseDoesNot) {
  ASSERT_TRUE(s.arm(5, 1000ms));
  s.say(event(1, 5, s.now), CTP_RELEASE);
  EXPECT_TRUE(s.facts().armed);
  s.say(event(2, 5, s.now), CTP_REVOKED);
  EXPECT_FALSE(s.facts().armed);
}

TEST_F(CoreArming, AnEdgeInTheFutureIsTheInstantThatItWasHeardWithThatDoubt) {
  // A millisecond and five sigmas (0.1 ms, of a line that is faster than its baud rate).
  s.say(event(1, 0, s.now + 1400us), CTP_CONTACT);
  s.say(event(2, 0, s.now + 1700us), CTP_CONTACT);
  s.run(1ms);
  ASSERT_EQ(s.events.size(), 2u);
  EXPECT_LT(s.events[0].time_sigma_s, 200e-6);
  EXPECT_NEAR(s.events[1].time_sigma_s, 1.7e-3, 5e-6);
  EXPECT_LE(s.events[1].first_edge, s.now);
}

TEST(CoreEvents, BeforeThereIsAClockMapNothingIsKnownOfTheInstant) {
  ScriptedSensor s;
  s.pongs = false;
  s.core.connect(s.now);
  s.run(300ms);
  const TimePoint heard = s.now;
  s.say(ctp::Event{1, 0, 123, 0, 2, 1, 700}, CTP_CONTACT);
  s.run(1ms);
  ASSERT_EQ(s.events.size(), 1u);
  EXPECT_EQ(s.events[0].first_edge, heard);
  EXPECT_EQ(s.events[0].time_sigma_s, 1.0);
}

TEST_F(CoreArming, EventsThatNobodyTakesAreCounted) {
  for (std::uint16_t i = 1; i <= 70; ++i) s.say(event(i, 0, s.now), CTP_REVOKED);
  EXPECT_EQ(s.facts().lost_events, 6u);
  s.run(1ms);
  EXPECT_EQ(s.events.size(), 64u);
}

TEST_F(CoreArming, TellsTheQualityOfTheLine) {
  s.status.errors = 3;
  s.status.sense_mv = 4321;
  s.run(4s);
  ContactFacts facts = s.facts();
  EXPECT_EQ(facts.sensor_errors, 3u);
  EXPECT_NEAR(facts.sense_v.value(), 4.321, 1e-9);
  EXPECT_EQ(facts.clock_limit_s, s.options.max_clock_sigma_s);
  EXPECT_GT(facts.quality.clock_sigma_s, 0.0);
  EXPECT_LT(facts.quality.clock_sigma_s, 200e-6);
  EXPECT_LE(facts.quality.round_trip->min_s, facts.quality.round_trip->p50_s);
  EXPECT_LE(facts.quality.round_trip->p50_s, facts.quality.round_trip->p99_s);
  EXPECT_LT(facts.quality.heartbeat_jitter_s, 1e-6);
  EXPECT_GT(facts.quality.frames, 400u);
  EXPECT_EQ(facts.quality.crc_errors + facts.quality.gaps + facts.quality.unknown_types, 0u);
  // Heartbeats that come up to 4 ms later than they are stamped.
  s.beats = false;
  for (int i = 0; i < 600; ++i) {
    s.run(10ms);
    s.status.t = s.ticks(s.now - std::chrono::milliseconds(i % 2 == 0 ? 0 : 4));
    s.say(s.status);
  }
  EXPECT_NEAR(s.facts().quality.heartbeat_jitter_s, 2e-3, 0.2e-3);
  const std::uint8_t damaged[] = {3, 1, 2, 0, 9, 1, 0};
  s.core.on_bytes(damaged, s.now);
  EXPECT_EQ(s.facts().quality.crc_errors, 2u);
}

// Self-test ---------------------------------------------------------------------------------------

TEST_F(CoreArming, ASelfTestIsRenewedHalfWayThroughItsAge) {
  s.sent.clear();
  s.run(290s);
  EXPECT_EQ(s.count(CTP_SELFTEST), 0u);
  s.run(20s);
  EXPECT_EQ(s.count(CTP_SELFTEST), 1u);
  EXPECT_TRUE(s.facts().self_test_ok);
}

TEST_F(CoreArming, ASelfTestIsTriedThreeTimesAndThenEverySecond) {
  s.passes = false;
  s.core.self_test(s.now);
  EXPECT_FALSE(s.facts().self_test_ok);
  ASSERT_TRUE(s.run_until([&] { return s.facts().fault != ContactFault::kNone; }));
  EXPECT_EQ(s.facts().fault, ContactFault::kSelfTestFailed);
  EXPECT_EQ(s.facts().step, ContactStep::kSelfTest);
  EXPECT_FALSE(s.snapshot().alive);
  const auto tries = s.times(CTP_SELFTEST);
  EXPECT_EQ(tries.size(), 3u);
  const double timeout_ms = 60.0 + 20.0 + 8.0 * int{CTP_MAX_WIRE} * int{CTP_BITS_PER_BYTE} / 1000.0;
  for (const double gap : gaps_ms(tries)) EXPECT_NEAR(gap, timeout_ms, 1.3);
  const TimePoint failed = s.now;
  s.sent.clear();
  ASSERT_TRUE(s.run_until([&] { return s.count(CTP_SELFTEST) == 1; }));
  EXPECT_NEAR(std::chrono::duration<double>(s.now - failed).count(), 1.0, 2e-3);
  s.run(500ms);
  EXPECT_EQ(s.count(CTP_SELFTEST), 3u) << "three times each time";
  s.passes = true;
  ASSERT_TRUE(s.run_until([&] { return s.facts().step == ContactStep::kReady; }));
  EXPECT_EQ(s.facts().fault, ContactFault::kNone);
}

TEST_F(CoreArming, ASelfTestHasNotFailedWhileNothingAtAllIsHeard) {
  s.core.self_test(s.now);
  s.run(2ms);  // it has begun
  s.beats = false;
  s.run(290ms);
  EXPECT_EQ(s.facts().fault, ContactFault::kNone) << "its answer may be under way";
  s.beats = true;
  ASSERT_TRUE(s.run_until([&] { return s.facts().self_test_ok; }, 200ms));
  EXPECT_EQ(s.facts().fault, ContactFault::kNone);
  EXPECT_EQ(s.facts().step, ContactStep::kReady);
}

TEST_F(CoreArming, DamageOnTheWayFromTheSensorIsNotTakenForASensorThatHearsNothing) {
  s.tests = s.beats = false;
  s.core.self_test(s.now);
  for (int i = 0; s.facts().fault == ContactFault::kNone && i < 100; ++i) {
    s.run(10ms);
    s.status.t = s.ticks(s.now);
    auto damaged = ctp::build(s.status, 0, CTP_STATUS);
    std::vector<std::uint8_t> bytes(damaged.bytes().begin(), damaged.bytes().end());
    bytes[4] ^= 0x55;
    s.core.on_bytes(bytes, s.now);
    if (i % 5 == 4) s.say_status();  // one of them arrives
  }
  EXPECT_EQ(s.facts().fault, ContactFault::kDamaged);
}

TEST_F(CoreArming, AContactIsHeldAgainstTheHeartbeatsBehindItsStamp) {
  ASSERT_TRUE(s.arm(5, 5s));
  s.run(300ms);
  for (const auto& [number, early] : {std::pair{1, 200ms}, {2, 30ms}, {3, 0ms}}) {
    s.events.clear();
    s.say(event(static_cast<std::uint16_t>(number), 5, s.now - early), CTP_CONTACT);
    s.set(CTP_FLAG_CONTACT, false);
    s.run(1ms);
    ASSERT_EQ(s.events.size(), 1u);
    EXPECT_EQ(s.events[0].denied_s > 0.0, early > 0ms);
    EXPECT_NEAR(s.events[0].denied_s, std::chrono::duration<double>(early).count(), 0.011);
  }
}

TEST_F(CoreArming, AContactIsHeldAgainstAHeartbeatThatWasArmedBehindItsStamp) {
  ASSERT_TRUE(s.arm(5, 5s));
  s.run(300ms);
  s.set(CTP_FLAG_CONTACT, true);  // not open behind the stamp, but not tripped either
  s.run(60ms);
  s.events.clear();
  s.say(event(1, 5, s.now - 30ms), CTP_CONTACT);
  s.run(1ms);
  ASSERT_EQ(s.events.size(), 1u);
  EXPECT_NEAR(s.events[0].denied_s, 0.030, 0.011);
}

TEST_F(CoreArming, WhyASelfTestFailsIsToldApart) {
  s.tests = false;  // it does not even start: the preceding flag remains
  s.core.self_test(s.now);
  ASSERT_TRUE(s.run_until([&] { return s.facts().fault != ContactFault::kNone; }));
  EXPECT_EQ(s.facts().fault, ContactFault::kDeaf);
  EXPECT_FALSE(s.facts().self_test_ok);
  s.tests = true;
  ASSERT_TRUE(s.run_until([&] { return s.facts().step == ContactStep::kReady; }));
  s.passes = false;
  s.set(CTP_FLAG_LOOP_OK, false);
  s.core.self_test(s.now);
  ASSERT_TRUE(s.run_until([&] { return s.facts().fault != ContactFault::kNone; }));
  EXPECT_EQ(s.facts().fault, ContactFault::kLoopBroken);
}

TEST_F(CoreArming, ALoopThatBreaksOutsideOfATestIsAFaultAtOnce) {
  s.set(CTP_FLAG_LOOP_OK, false);
  s.say_status();
  EXPECT_EQ(s.facts().fault, ContactFault::kLoopBroken);
  EXPECT_EQ(s.facts().step, ContactStep::kSelfTest);
  EXPECT_EQ(s.facts().loop_ok, false);
  EXPECT_FALSE(s.snapshot().alive);
}

TEST_F(CoreArming, AContactThatLastsASecondIsExaminedAndItsLoopGuardsTheWayOut) {
  s.passes = false;  // in contact there is no edge
  touch(true);
  const TimePoint touched = s.now;
  s.sent.clear();
  ASSERT_TRUE(s.run_until([&] { return s.count(CTP_SELFTEST) == 1; }));
  const double after_s = std::chrono::duration<double>(s.now - touched).count();
  EXPECT_GT(after_s, 1.0);
  EXPECT_LT(after_s, 1.4);
  s.run(50ms);
  EXPECT_TRUE(s.facts().touching_at_self_test);
  EXPECT_EQ(s.facts().fault, ContactFault::kNone);
  EXPECT_EQ(s.facts().step, ContactStep::kReady);
  // Tested again every second while it lasts.
  s.sent.clear();
  s.run(3100ms);
  EXPECT_NEAR(static_cast<double>(s.count(CTP_SELFTEST)), 3.0, 1.0);
  s.passes = true;
  touch(false);
  ASSERT_TRUE(s.run_until([&] { return !s.facts().touching_at_self_test; }));
  EXPECT_TRUE(s.facts().self_test_ok);
}

TEST(CoreTouching, ASensorThatIsInContactFromTheBeginningIsAliveAndNotReady) {
  ScriptedSensor s;
  s.passes = false;
  s.set(CTP_FLAG_CONTACT, true);
  s.core.connect(s.now);
  s.run(2s);
  EXPECT_EQ(s.facts().step, ContactStep::kSelfTest);
  EXPECT_TRUE(s.facts().touching_at_self_test);
  EXPECT_TRUE(s.snapshot().alive);
  EXPECT_TRUE(s.snapshot().in_contact);
  EXPECT_EQ(s.refusal(1, 1s), ArmRefusal::kNotReady);
  s.set(CTP_FLAG_LOOP_OK, false);
  s.run(2s);
  EXPECT_EQ(s.facts().fault, ContactFault::kLoopBroken);
  EXPECT_FALSE(s.snapshot().alive);
}

TEST_F(CoreArming, AShortContactIsNotExamined) {
  for (int i = 0; i < 5; ++i) {
    touch(true);
    s.run(900ms);
    touch(false);
    s.run(100ms);
  }
  EXPECT_EQ(s.count(CTP_SELFTEST), 0u);
}

TEST_F(CoreArming, NoSelfTestBeginsUnderArm) {
  ASSERT_TRUE(s.arm(5, 1000ms));
  s.sent.clear();
  s.core.self_test(s.now);
  s.run(300ms);
  EXPECT_EQ(s.count(CTP_SELFTEST), 0u);
  EXPECT_TRUE(s.facts().armed);
  s.core.disarm(s.now);
  s.run(50ms);
  EXPECT_EQ(s.count(CTP_SELFTEST), 1u);
}

}  // namespace
}  // namespace cellcal::drivers
