// Delay of the sensor's bytes, judged by its own stamps at each limit; state discarded when opened;
// bytes that are not frames; figures of the line's quality.

#include <cmath>

#include "scripted_sensor.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

using namespace std::chrono_literals;

Duration of_seconds(double s) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(s));
}

struct CoreDelivery : testing::Test {
  void SetUp() override { ASSERT_TRUE(s.get_ready()); }

  /// A heartbeat whose last bit was sent this long ago.
  void heartbeat(double late_s) {
    const double wire_s = (int{CTP_STATUS_SIZE} + int{CTP_OVERHEAD}) * int{CTP_BITS_PER_BYTE} /
                          static_cast<double>(s.options.baud);
    s.status.t = s.ticks(s.now - of_seconds(late_s + wire_s));
    s.say(s.status);
  }
  /// No data until the core has given up waiting.
  void fall_silent(bool armed) {
    s.beats = s.pongs = s.identifies = false;
    ASSERT_TRUE(s.run_until([&] { return armed ? !s.facts().armed : !s.snapshot().alive; }));
    s.run(1ms);
    given_up = s.now;
  }
  ContactQuality quality() const { return s.facts().quality; }

  ScriptedSensor s;
  TimePoint given_up{};
};

TEST_F(CoreDelivery, IsMeasuredFromTheEndOfTheHeartbeatOnTheWire) {
  s.beats = false;
  heartbeat(0.004);
  EXPECT_NEAR(quality().late_worst_s, 0.004, 2e-6);
  heartbeat(9.0);
  EXPECT_NEAR(quality().late_worst_s, 9.0, 1e-3);
  heartbeat(11.0);
  EXPECT_NEAR(quality().late_worst_s, 9.0, 1e-3) << "more than ten seconds is another clock";
}

TEST_F(CoreDelivery, EndsAnArmingWhereItIsLateBeyondItsLimitAndTheClocksDoubt) {
  const double sigma = quality().clock_sigma_s.value();
  ASSERT_GT(sigma, 5e-6);
  ASSERT_TRUE(s.arm(5, 1000ms));
  s.beats = false;
  heartbeat(0.025 + 2.0 * sigma);
  EXPECT_TRUE(s.facts().armed);
  s.sent.clear();
  heartbeat(0.025 + 4.5 * sigma);
  EXPECT_FALSE(s.facts().armed);
  EXPECT_EQ(s.facts().last_arm_end, ArmEnd::kDeliveredLate);
  EXPECT_EQ(s.count(CTP_DISARM), 1u);
  EXPECT_NEAR(s.facts().delivered_late_s, 0.025 + 4.5 * sigma, 1e-5);
  EXPECT_EQ(s.facts().late_limit_s, 0.025);
  EXPECT_EQ(s.snapshot().delivered_late_s, s.facts().delivered_late_s);
  EXPECT_EQ(s.snapshot().late_limit_s, 0.025);
}

TEST_F(CoreDelivery, EndsNoArmingWhileAnotherStopPathWatches) {
  ASSERT_TRUE(s.arm(5, 5000ms));
  s.core.set_silence_limit(600ms);
  s.beats = s.pongs = false;
  s.run(590ms);
  EXPECT_TRUE(s.facts().armed && s.snapshot().alive) << "beyond the idle limit as well";
  const std::uint32_t late = s.facts().delivery.late;
  heartbeat(0.55);
  EXPECT_TRUE(s.facts().armed);
  EXPECT_EQ(s.facts().delivery.late, late + 1) << "it counts all the same";
  s.sent.clear();
  s.run(610ms);
  EXPECT_FALSE(s.facts().armed || s.snapshot().alive);
  EXPECT_EQ(s.facts().last_arm_end, ArmEnd::kSilence);
  EXPECT_EQ(s.count(CTP_DISARM), 1u);
}

TEST_F(CoreDelivery, EndsAnArmingOnceTheOtherStopPathWatchesNoMore) {
  ASSERT_TRUE(s.arm(5, 5000ms));
  s.core.set_silence_limit(600ms);
  s.beats = s.pongs = false;
  s.run(100ms);
  ASSERT_TRUE(s.facts().armed);
  s.core.set_silence_limit(kHeartbeatLimit);
  s.run(1ms);
  EXPECT_FALSE(s.facts().armed);
}

TEST_F(CoreDelivery, KeepsAnArmingAliveWhoseAnswerMayBeLate) {
  s.core.set_silence_limit(600ms);
  s.arms = false;
  s.core.arm(5, 5000ms, s.now);
  s.run(100ms);
  s.sent.clear();
  s.run(300ms);
  EXPECT_GE(s.count(CTP_KEEPALIVE), 25u);
  EXPECT_FALSE(s.core.poll_arm()) << "not given up";
  s.run(600ms);
  const auto answer = s.core.poll_arm();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->refusal, ArmRefusal::kNoAnswer);
}

TEST_F(CoreDelivery, ExplainsASilenceUnderArmWhereItIsAThirdOfTheLimitAndWasSentBefore) {
  struct Case {
    double sent_before_s, late_s;
    bool explains;
  };
  // The heartbeat arrives late_s after it was sent; sent_before_s before the core gave up.
  for (const Case& one :
       {Case{0.003, 0.0080, false}, Case{0.003, 0.0087, true}, Case{-0.003, 0.0180, false}}) {
    s.core.disconnect(s.now);
    s.identifies = s.beats = s.pongs = true;
    ASSERT_TRUE(s.get_ready());
    ASSERT_TRUE(s.arm(5, 1000ms));
    fall_silent(true);
    const double since_s = std::chrono::duration<double>(s.now - given_up).count();
    s.run(of_seconds(one.late_s - one.sent_before_s - since_s - 0.001));
    EXPECT_EQ(s.facts().last_arm_end, ArmEnd::kSilence) << "nobody knows yet";
    EXPECT_TRUE(s.facts().delivery.open && s.snapshot().silence_open);
    const ContactDelivery before = s.facts().delivery;
    const double silent_s = s.facts().silent_s;
    heartbeat(one.late_s);
    EXPECT_FALSE(s.facts().delivery.open || s.snapshot().silence_open);
    EXPECT_EQ(s.facts().delivery.late, before.late + (one.explains ? 1 : 0));
    EXPECT_EQ(s.facts().delivery.silent, before.silent + (one.explains ? 0 : 1));
    EXPECT_EQ(s.facts().last_arm_end, one.explains ? ArmEnd::kDeliveredLate : ArmEnd::kSilence)
        << one.late_s;
    // A single figure with its own limit: duration without data.
    EXPECT_NEAR(s.facts().delivered_late_s, one.explains ? silent_s : 0.0, 1e-5);
    EXPECT_TRUE(!one.explains || s.facts().delivered_late_s > s.facts().late_limit_s);
    // The first one to arrive decides.
    heartbeat(0.020);
    EXPECT_EQ(s.facts().last_arm_end, one.explains ? ArmEnd::kDeliveredLate : ArmEnd::kSilence);
  }
}

TEST_F(CoreDelivery, ASilentSensorHasNoContactNoLoopNoClockAndIsNotAlive) {
  EXPECT_EQ(s.facts().loop_ok, true);
  EXPECT_EQ(s.facts().in_contact, false);
  fall_silent(false);
  const ContactStatus status = status_of(s.facts());
  EXPECT_FALSE(status.loop_ok.has_value() || status.in_contact.has_value());
  EXPECT_FALSE(status.sense_voltage_v || status.quality.round_trip);
  EXPECT_FALSE(status.quality.clock_sigma_s || status.quality.clock_drift_ppm);
  EXPECT_FALSE(s.snapshot().alive || status.self_test_ok || status.clock_ok);
  EXPECT_EQ(s.refusal(5, 1000ms), ArmRefusal::kNotReady);
}

TEST(CoreSteps, ALoopThatTheSensorHasNotTestedIsNotBroken) {
  ScriptedSensor s;
  s.tests = false;
  s.set(CTP_FLAG_LOOP_OK, false);
  s.core.connect(s.now);
  ASSERT_TRUE(s.run_until([&] { return s.facts().step == ContactStep::kSelfTest; }));
  EXPECT_TRUE(s.facts().in_contact.has_value());
  EXPECT_FALSE(s.facts().loop_ok.has_value());
}

TEST_F(CoreDelivery, ExplainsAnIdleSilenceByItsOwnName) {
  fall_silent(false);
  EXPECT_EQ(s.facts().fault, ContactFault::kSilent);
  s.run(200ms);
  const double silent_s = s.facts().silent_s;
  heartbeat(0.3);
  EXPECT_EQ(s.facts().fault, ContactFault::kDeliveredLate);
  EXPECT_NEAR(s.facts().delivered_late_s, silent_s, 1e-5);
  EXPECT_EQ(s.facts().late_limit_s, 0.3);
  EXPECT_EQ(s.facts().step, ContactStep::kHello) << "it is identified anew all the same";
  // After a jump of its clock nothing is known about the sensor.
  s.identifies = s.beats = s.pongs = true;
  ASSERT_TRUE(s.run_until([&] { return s.facts().step == ContactStep::kReady; }));
  s.clock_off = 10s;
  ASSERT_TRUE(s.run_until([&] { return s.facts().fault == ContactFault::kClockJumped; }));
  heartbeat(0.3);
  EXPECT_EQ(s.facts().fault, ContactFault::kClockJumped);
}

TEST_F(CoreDelivery, ASilenceBehindALatenessIsNotExplainedByIt) {
  ASSERT_TRUE(s.arm(5, 1000ms));
  s.beats = false;
  heartbeat(0.040);
  ASSERT_GT(s.snapshot().delivered_late_s, 0.0);
  fall_silent(false);  // a cable pulled, soon after
  EXPECT_EQ(s.snapshot().delivered_late_s, 0.0);
  EXPECT_TRUE(s.snapshot().silence_open);
}

TEST_F(CoreDelivery, StatesWithTheLastArmingsEndTheLatenessThatEndedIt) {
  ASSERT_TRUE(s.arm(5, 1000ms));
  s.beats = false;
  heartbeat(0.040);
  const std::string words = said(words_of(s.facts()));
  EXPECT_NE(words.find("sensor data 40 ms late (limit 25 ms)"), std::string::npos) << words;
  fall_silent(false);
  heartbeat(0.35);
  EXPECT_EQ(s.facts().late_limit_s, 0.3);
  s.identifies = s.beats = s.pongs = true;
  ASSERT_TRUE(s.run_until([&] { return s.facts().step == ContactStep::kReady; }));
  EXPECT_EQ(s.facts().delivered_late_s, 0.0);
  EXPECT_EQ(said(words_of(s.facts())), words);
}

TEST_F(CoreDelivery, CountsWhatComesLateWithoutAnArmingToo) {
  s.beats = false;
  heartbeat(0.020);
  EXPECT_EQ(s.facts().delivery.late, 0u);
  heartbeat(0.030);
  EXPECT_EQ(s.facts().delivery.late, 1u);
  EXPECT_EQ(s.snapshot().delivered_late_s, 0.0) << "nothing is stopped by it";
  EXPECT_EQ(s.facts().fault, ContactFault::kNone);
  s.core.disconnect(s.now);
  s.core.connect(s.now);
  EXPECT_EQ(s.facts().delivery.late, 1u) << "counts never go back";
}

TEST_F(CoreDelivery, KnowsWhetherItsClockMapIsGood) {
  EXPECT_TRUE(s.facts().clock_ok);
  s.pongs = false;
  s.run(3500ms);
  EXPECT_FALSE(s.facts().clock_ok) << "no answer for three seconds";
}

// ---- quality ----------------------------------------------------------------------------------------

TEST_F(CoreDelivery, TellsTheMiddleTheWorstOfTheNewestAndTheWorstOfAll) {
  s.core.disconnect(s.now);
  s.beats = false;
  s.status.flags = CTP_FLAG_LOOP_OK;
  s.core.connect(s.now);
  s.run(100ms);
  s.say_status();  // the configuration is taken
  s.run(1s);       // and the clock is known
  ASSERT_EQ(s.facts().step, ContactStep::kSelfTest);
  EXPECT_EQ(quality().late_p50_s, 0.0);
  EXPECT_EQ(quality().late_max_s, 0.0);
  heartbeat(0.005);
  EXPECT_NEAR(quality().late_p50_s, 0.005, 1e-5) << "one is its own middle";
  EXPECT_NEAR(quality().late_max_s, 0.005, 1e-5);
  for (int i = 0; i < 256; ++i) heartbeat(0.001 * (1 + i % 4));
  EXPECT_NEAR(quality().late_p50_s, 0.003, 1e-5);
  EXPECT_NEAR(quality().late_max_s, 0.004, 1e-5);
  EXPECT_NEAR(quality().late_worst_s, 0.005, 1e-5);
}

TEST_F(CoreDelivery, OfFourHeartbeatsTheThirdIsTheMiddle) {
  s.core.disconnect(s.now);
  s.beats = false;
  s.status.flags = CTP_FLAG_LOOP_OK;
  s.core.connect(s.now);
  s.run(100ms);
  s.say_status();
  s.run(1s);
  for (const double late_s : {0.004, 0.001, 0.003, 0.002}) heartbeat(late_s);
  EXPECT_NEAR(quality().late_p50_s, 0.003, 1e-5);
  EXPECT_NEAR(quality().late_max_s, 0.004, 1e-5);
}

TEST(CoreQuality, JitterIsWhatChangesAndAFiftiethOfTheNewest) {
  ScriptedSensor s;
  ASSERT_TRUE(s.get_ready());
  EXPECT_LT(s.facts().quality.heartbeat_jitter_s, 1e-6);
  // After reopening all of them are 10 ms old, uniformly.
  s.core.disconnect(s.now);
  s.beats = false;
  s.core.connect(s.now);
  const auto heartbeat = [&](Duration age) {
    s.run(10ms);
    s.status.t = s.ticks(s.now - age);
    s.say(s.status);
  };
  for (int i = 0; i < 200; ++i) heartbeat(10ms);
  ASSERT_GT(s.facts().quality.clock_sigma_s, 0.0);
  EXPECT_LT(s.facts().quality.heartbeat_jitter_s, 1e-5) << "a delay that stays is no jitter";
  heartbeat(20ms);
  EXPECT_NEAR(s.facts().quality.heartbeat_jitter_s, 10e-3 * std::sqrt(0.02), 1e-5);
}

TEST(CoreQuality, CountsEachKindOfDamageAndFramesThatNobodyKnows) {
  ScriptedSensor s;
  ASSERT_TRUE(s.get_ready());
  const ContactQuality before = s.facts().quality;
  const std::uint64_t bytes = s.facts().bytes;
  EXPECT_GT(bytes, 100u);
  std::vector<std::uint8_t> endless(200, 0x55);
  endless.push_back(0);
  s.core.on_bytes(endless, s.now);
  EXPECT_EQ(s.facts().quality.crc_errors, before.crc_errors + 1);
  EXPECT_EQ(s.facts().bytes, bytes + 201);
  const std::vector<std::uint8_t> payload{1, 2, 3};
  s.core.on_bytes(ctp::build_frame(0xEE, 0, payload).bytes(), s.now);
  EXPECT_EQ(s.facts().quality.unknown_types, before.unknown_types + 1);
}

// ---- opening ----------------------------------------------------------------------------------------

TEST_F(CoreDelivery, AnOpeningForgetsTheOneBefore) {
  s.beats = false;
  heartbeat(0.2);
  s.core.disconnect(s.now);
  s.identifies = s.pongs = false;
  s.core.connect(s.now);
  const ContactFacts facts = s.facts();
  EXPECT_FALSE(facts.heard);
  EXPECT_EQ(facts.bytes, 0u);
  EXPECT_EQ(facts.quality.late_worst_s, 0.0);
  EXPECT_EQ(facts.quality.late_p50_s, 0.0);
  EXPECT_EQ(facts.quality.late_max_s, 0.0);
  EXPECT_EQ(facts.version, 0);
  s.say_status();
  EXPECT_TRUE(s.facts().heard);
  EXPECT_EQ(s.facts().bytes, 18u) << "twelve and the frame around them";
  // An earlier ready state does not make a restart now a loss.
  s.identifies = s.beats = true;
  ASSERT_TRUE(s.run_until([&] { return s.facts().step == ContactStep::kClock; }));
  s.ident.boot_id = 99;
  s.ident.nonce = 0;
  s.say(s.ident);
  EXPECT_EQ(s.facts().fault, ContactFault::kNone);
}

TEST_F(CoreDelivery, OneThatComesWithoutAClosingForgetsAsMuch) {
  ASSERT_TRUE(s.arm(5, 1000ms));
  s.identifies = false;
  s.core.connect(s.now);
  EXPECT_FALSE(s.facts().armed);
  EXPECT_EQ(s.facts().step, ContactStep::kHello);
  // A fault from before the reopening does not persist.
  ScriptedSensor other;
  other.identifies = false;
  other.nak_hello = CTP_NAK_BAD_VERSION;
  other.core.connect(other.now);
  other.run(1s);
  ASSERT_EQ(other.facts().fault, ContactFault::kVersion);
  other.core.connect(other.now);
  EXPECT_EQ(other.facts().fault, ContactFault::kNone);
  other.run(1s);
  ASSERT_EQ(other.facts().fault, ContactFault::kVersion);
  other.core.disconnect(other.now);
  EXPECT_EQ(other.facts().fault, ContactFault::kNone);
}

TEST_F(CoreDelivery, ASelfTestThatRanIsNotGoneOnWithInTheNextOpening) {
  s.tests = false;
  s.core.self_test(s.now);
  ASSERT_EQ(s.count(CTP_SELFTEST), 1u);
  s.core.disconnect(s.now);
  s.identifies = false;
  s.core.connect(s.now);
  s.sent.clear();
  s.run(1s);
  EXPECT_EQ(s.count(CTP_SELFTEST), 0u);
  EXPECT_EQ(s.facts().step, ContactStep::kHello);
}

TEST_F(CoreDelivery, TheFirstPingOfEachOpeningGoesOutAtOnce) {
  ASSERT_TRUE(s.run_until([&] { return s.count(CTP_PING) > 0; }));  // the next is far
  s.core.disconnect(s.now);
  s.core.connect(s.now);
  s.sent.clear();
  ASSERT_TRUE(s.run_until([&] { return s.facts().step == ContactStep::kClock; }));
  s.run(1ms);
  EXPECT_EQ(s.count(CTP_PING), 1u);
}

TEST(CoreOpening, AsksEachTimeByAnotherNumber) {
  std::vector<std::uint32_t> nonces;
  for (const Duration later : {0ms, 1ms, 500ms}) {
    ScriptedSensor s;
    s.identifies = s.beats = false;
    s.now += later;
    for (int opening = 0; opening < 2; ++opening) {
      s.sent.clear();
      s.core.connect(s.now);
      ASSERT_EQ(s.count(CTP_HELLO), 1u);
      nonces.push_back(ctp::read<ctp::Hello>(s.sent.back().frame).nonce);
      s.run(1s);
    }
  }
  std::sort(nonces.begin(), nonces.end());
  EXPECT_EQ(std::adjacent_find(nonces.begin(), nonces.end()), nonces.end())
      << "an answer to an earlier opening is no answer to this one";
}

// ---- bytes that are not frames ----------------------------------------------------------------------

struct CoreGarbage : testing::Test {
  void SetUp() override {
    s.identifies = s.beats = false;
    s.core.connect(s.now);
    opened = s.now;
  }
  void garbage(std::size_t bytes) {
    s.core.on_bytes(std::vector<std::uint8_t>(bytes, 0xF8), s.now);
  }
  ContactFault fault_after(Duration d) {
    s.core.on_tick(opened + d);
    return s.core.facts(opened + d).fault;
  }
  ScriptedSensor s;
  TimePoint opened{};
};

TEST_F(CoreGarbage, IsAnotherBaudRateOnceThereAreTwelveForMoreThanASecondAndAHalf) {
  garbage(12);
  EXPECT_EQ(fault_after(100ms), ContactFault::kNone);
  EXPECT_EQ(fault_after(1500ms), ContactFault::kNone);
  EXPECT_EQ(fault_after(1500ms + 1us), ContactFault::kBaud);
}
TEST_F(CoreGarbage, OfElevenBytesIsNothing) {
  garbage(11);
  EXPECT_EQ(fault_after(5s), ContactFault::kNone);
}
TEST_F(CoreGarbage, BesideASoundFrameIsNoise) {
  garbage(100);
  const std::uint8_t end = 0;
  s.core.on_bytes({&end, 1}, s.now);
  s.say_status();
  EXPECT_EQ(fault_after(5s), ContactFault::kNone);
  s.say(ctp::Nak{CTP_HELLO, CTP_NAK_BAD_VERSION});
  EXPECT_EQ(fault_after(10s), ContactFault::kVersion);
}

// ---- step by step -----------------------------------------------------------------------------------

TEST(CoreSteps, ASensorThatRestartsOrFallsSilentWhileItIsConfiguredIsIdentifiedAnew) {
  for (const bool restarts : {true, false}) {
    ScriptedSensor s;
    s.status.config_crc = CTP_CONFIG_NONE;
    s.core.connect(s.now);
    s.run(200ms);
    ASSERT_EQ(s.facts().step, ContactStep::kConfig);
    s.identifies = false;
    if (restarts) {
      s.ident.boot_id = 8;
      s.ident.nonce = 0;
      s.say(s.ident);
    } else {
      s.beats = false;
      s.run(302ms);
      EXPECT_EQ(s.facts().fault, ContactFault::kSilent);
    }
    EXPECT_EQ(s.facts().step, ContactStep::kHello) << restarts;
  }
}

TEST_F(CoreDelivery, TheIdleLimitItselfIsNoSilence) {
  s.beats = s.pongs = false;
  const TimePoint last = s.now - of_seconds(s.facts().silent_s);
  s.core.on_tick(last + kIdleLimit);
  EXPECT_EQ(s.core.facts(last + kIdleLimit).step, ContactStep::kReady);
  s.core.on_tick(last + kIdleLimit + 1us);
  EXPECT_EQ(s.core.facts(last + kIdleLimit + 1us).step, ContactStep::kHello);
}

TEST_F(CoreDelivery, AnArmingOfASensorThatForgotItsConfigurationEndsWithTheLink) {
  ASSERT_TRUE(s.arm(5, 1000ms));
  s.status.config_crc = CTP_CONFIG_NONE;
  s.say_status();
  EXPECT_EQ(s.facts().step, ContactStep::kHello);
  EXPECT_EQ(s.facts().last_arm_end, ArmEnd::kLinkLost);
}

TEST_F(CoreDelivery, AnAnswerEndsTheFaultOfTheSilenceBeforeIt) {
  fall_silent(false);
  ASSERT_EQ(s.facts().fault, ContactFault::kSilent);
  s.identifies = true;
  s.status.config_crc = CTP_CONFIG_NONE;
  ASSERT_TRUE(s.run_until([&] { return s.facts().step == ContactStep::kConfig; }));
  EXPECT_EQ(s.facts().fault, ContactFault::kNone);
}

TEST_F(CoreDelivery, AContactThatAnEventToldOfIsExaminedASecondLater) {
  s.run(5s);
  s.passes = false;
  s.sent.clear();
  ctp::Event event;
  event.event = 7;
  event.t_first = s.ticks(s.now);
  s.set(CTP_FLAG_CONTACT, true);
  const TimePoint touched = s.now;
  s.say(event, CTP_CONTACT);
  ASSERT_TRUE(s.run_until([&] { return s.count(CTP_SELFTEST) == 1; }));
  EXPECT_GT(std::chrono::duration<double>(s.now - touched).count(), 1.0);
}

TEST(CoreSteps, ASensorThatRefusedOnceAndIsMuteIsStillAskedEveryTwoSeconds) {
  ScriptedSensor hello;
  hello.identifies = false;
  hello.nak_hello = CTP_NAK_BAD_VERSION;
  hello.core.connect(hello.now);
  hello.run(100ms);
  hello.nak_hello = 0;
  hello.sent.clear();
  hello.run(9s);
  EXPECT_EQ(hello.facts().fault, ContactFault::kVersion);
  expect_every(hello.times(CTP_HELLO), 2000, 4);
  ScriptedSensor config;
  config.status.config_crc = CTP_CONFIG_NONE;
  config.nak_config = CTP_NAK_BAD_ARGUMENT;
  config.core.connect(config.now);
  config.run(100ms);
  ASSERT_EQ(config.facts().fault, ContactFault::kConfigRefused);
  config.nak_config = 0;
  config.sent.clear();
  config.run(9s);
  expect_every(config.times(CTP_CONFIG), 2000, 4);
}

}  // namespace
}  // namespace cellcal::drivers
