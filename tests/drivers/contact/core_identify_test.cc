// Requests of the host to a sensor until it is ready, their period, and the effect of each answer.

#include "scripted_sensor.h"

namespace cellcal::drivers {
namespace {

using namespace std::chrono_literals;

TEST(CoreIdentify, AsksFiveTimesASecondUntilItIsAnswered) {
  ScriptedSensor s;
  s.identifies = s.beats = false;
  s.core.connect(s.now);
  s.run(2s);
  expect_every(s.times(CTP_HELLO), 200, 10);
  EXPECT_EQ(s.sent.size(), s.count(CTP_HELLO));
  EXPECT_FALSE(s.facts().heard);
  EXPECT_NEAR(s.facts().waiting_s, 2.0, 1e-9);
  EXPECT_NEAR(s.facts().silent_s, 2.0, 1e-9);
  EXPECT_EQ(s.facts().version, 0);
}

TEST(CoreIdentify, AnAnswerToAnotherQuestionIsNone) {
  ScriptedSensor s;
  s.identifies = false;
  s.core.connect(s.now);
  s.run(50ms);
  s.ident.nonce = 12345;
  s.say(s.ident);
  s.run(100ms);
  EXPECT_EQ(s.facts().step, ContactStep::kHello);
  EXPECT_EQ(s.count(CTP_HELLO), 1u);
  // A sensor that has just started is queried immediately.
  s.ident.nonce = 0;
  s.say(s.ident);
  EXPECT_EQ(s.count(CTP_HELLO), 2u);
  EXPECT_EQ(s.facts().step, ContactStep::kHello);
}

TEST(CoreIdentify, GoesOnStepByStepAndSaysWhoItIs) {
  ScriptedSensor s;
  s.pongs = false;
  s.status.config_crc = CTP_CONFIG_NONE;
  s.core.connect(s.now);
  s.run(1s);
  EXPECT_EQ(s.facts().step, ContactStep::kConfig);
  expect_every(s.times(CTP_CONFIG), 100, 9);
  EXPECT_EQ(s.count(CTP_PING), 0u);
  EXPECT_EQ(s.facts().version, CTP_VERSION);
  EXPECT_EQ(s.facts().firmware, (std::array<std::uint8_t, 3>{1, 2, 3}));
  EXPECT_EQ(s.facts().uid, 0x11223344u);
  EXPECT_EQ(s.facts().boot_id, 7u);
  s.status.config_crc = ctp::config_crc(s.options.wire);
  s.sent.clear();
  s.run(20ms);
  EXPECT_EQ(s.facts().step, ContactStep::kClock);
  EXPECT_EQ(s.facts().config_crc, s.status.config_crc);
  EXPECT_GE(s.count(CTP_PING), 1u) << "at once";
  EXPECT_EQ(s.count(CTP_SELFTEST), 0u);
  s.run(2s);
  EXPECT_EQ(s.facts().step, ContactStep::kClock);
  s.pongs = true;
  s.passes = false;
  ASSERT_TRUE(s.run_until([&] { return s.facts().step == ContactStep::kSelfTest; }));
  EXPECT_EQ(s.facts().fault, ContactFault::kNone);
  EXPECT_FALSE(s.snapshot().alive);
  s.passes = true;
  ASSERT_TRUE(s.run_until([&] { return s.facts().step == ContactStep::kReady; }));
  EXPECT_TRUE(s.snapshot().alive);
  EXPECT_TRUE(s.facts().self_test_ok);
  EXPECT_NEAR(s.facts().waiting_s, 0.0, 1e-3);
}

TEST(CoreIdentify, AnotherVersionIsAskedAgainEveryTwoSeconds) {
  for (const bool by_ident : {true, false}) {
    ScriptedSensor s;
    if (by_ident) s.ident.version = CTP_VERSION + 1;
    if (!by_ident) s.identifies = false;
    if (!by_ident) s.nak_hello = CTP_NAK_BAD_VERSION;
    s.core.connect(s.now);
    s.run(7s);
    EXPECT_EQ(s.facts().fault, ContactFault::kVersion);
    EXPECT_EQ(s.facts().step, ContactStep::kHello);
    EXPECT_EQ(s.facts().version, by_ident ? CTP_VERSION + 1 : 0);
    expect_every(s.times(CTP_HELLO), 2000, 4);
    // Accepted after flashing.
    s.ident.version = CTP_VERSION;
    s.identifies = true;
    s.nak_hello = 0;
    ASSERT_TRUE(s.run_until([&] { return s.facts().step == ContactStep::kReady; }));
    EXPECT_EQ(s.facts().fault, ContactFault::kNone);
  }
}

TEST(CoreIdentify, ARefusalOfSomethingElseIsNoOtherVersion) {
  ScriptedSensor s;
  s.identifies = false;
  s.core.connect(s.now);
  s.run(10ms);
  s.say(ctp::Nak{CTP_HELLO, CTP_NAK_BAD_ARGUMENT});
  s.say(ctp::Nak{CTP_CONFIG, CTP_NAK_BAD_VERSION});
  s.say(ctp::Nak{CTP_ARM, CTP_NAK_BAD_VERSION});
  EXPECT_EQ(s.facts().fault, ContactFault::kNone);
  s.run(300ms);
  EXPECT_EQ(s.count(CTP_HELLO), 2u);
  ScriptedSensor ready;
  ASSERT_TRUE(ready.get_ready());
  ready.say(ctp::Nak{CTP_HELLO, CTP_NAK_BAD_VERSION});
  ready.say(ctp::Nak{CTP_CONFIG, CTP_NAK_BAD_ARGUMENT});
  EXPECT_EQ(ready.facts().fault, ContactFault::kNone);
  EXPECT_EQ(ready.facts().step, ContactStep::kReady);
}

TEST(CoreIdentify, ARefusedConfigurationIsSentAgainEveryTwoSeconds) {
  ScriptedSensor s;
  s.status.config_crc = CTP_CONFIG_NONE;
  s.nak_config = CTP_NAK_BAD_ARGUMENT;
  s.core.connect(s.now);
  s.run(7s);
  EXPECT_EQ(s.facts().fault, ContactFault::kConfigRefused);
  expect_every(s.times(CTP_CONFIG), 2000, 3);
}

TEST(CoreIdentify, ASensorThatRestartsInUseIsNotBelievedUntilSomebodyAcknowledges) {
  ScriptedSensor s;
  ASSERT_TRUE(s.get_ready());
  s.ident.boot_id = 8;
  s.ident.nonce = 0;
  s.say(s.ident);
  EXPECT_EQ(s.facts().fault, ContactFault::kLostState);
  EXPECT_EQ(s.facts().step, ContactStep::kHello);
  EXPECT_EQ(s.facts().boot_id, 8u);
  s.run(3s);
  EXPECT_EQ(s.sent.size(), 0u) << "it waits for a person";
  s.ident.boot_id = 9;
  s.say(s.ident);
  EXPECT_EQ(s.facts().boot_id, 9u);
  EXPECT_EQ(s.facts().fault, ContactFault::kLostState);
  s.core.self_test(s.now);
  EXPECT_EQ(s.count(CTP_HELLO), 1u);
  ASSERT_TRUE(s.run_until([&] { return s.facts().step == ContactStep::kReady; }));
  EXPECT_EQ(s.facts().fault, ContactFault::kNone);
}

TEST(CoreIdentify, ARestartBeforeItWasReadyLosesNothing) {
  ScriptedSensor s;
  s.pongs = false;
  s.core.connect(s.now);
  s.run(300ms);
  ASSERT_EQ(s.facts().step, ContactStep::kClock);
  s.ident.boot_id = 8;
  s.ident.nonce = 0;
  s.say(s.ident);
  EXPECT_EQ(s.facts().fault, ContactFault::kNone);
  s.pongs = true;
  ASSERT_TRUE(s.run_until([&] { return s.facts().step == ContactStep::kReady; }));
}

TEST(CoreIdentify, TheSameSensorAnnouncingItselfAgainChangesNothing) {
  ScriptedSensor s;
  ASSERT_TRUE(s.get_ready());
  s.ident.nonce = 0;
  s.say(s.ident);
  EXPECT_EQ(s.facts().step, ContactStep::kReady);
  EXPECT_EQ(s.facts().fault, ContactFault::kNone);
}

TEST(CoreIdentify, AfterSilenceASensorThatIsAnotherOneHasLostItsState) {
  for (const bool another : {false, true}) {
    ScriptedSensor s;
    ASSERT_TRUE(s.get_ready());
    s.beats = s.pongs = s.identifies = false;
    s.run(1s);
    EXPECT_EQ(s.facts().fault, ContactFault::kSilent);
    EXPECT_EQ(s.facts().step, ContactStep::kHello);
    EXPECT_FALSE(s.snapshot().alive);
    s.beats = s.pongs = s.identifies = true;
    if (another) s.ident.boot_id = 8;
    s.run(2s);
    EXPECT_EQ(s.facts().fault, another ? ContactFault::kLostState : ContactFault::kNone);
    EXPECT_EQ(s.facts().step, another ? ContactStep::kHello : ContactStep::kReady);
  }
}

TEST(CoreIdentify, SilenceIsJudgedByTheIdleLimit) {
  ScriptedSensor s;
  ASSERT_TRUE(s.get_ready());
  s.beats = s.pongs = s.identifies = false;
  const TimePoint last = s.now - std::chrono::duration_cast<Duration>(
                                     std::chrono::duration<double>(s.facts().silent_s));
  EXPECT_TRUE(s.core.snapshot(last + kIdleLimit).alive);
  EXPECT_FALSE(s.core.snapshot(last + kIdleLimit + 1ns).alive);
  s.run(last + kIdleLimit - s.now);
  EXPECT_EQ(s.facts().step, ContactStep::kReady);
  ASSERT_TRUE(s.run_until([&] { return s.facts().fault == ContactFault::kSilent; }, 2ms));
}

TEST(CoreIdentify, ASensorThatForgotItsConfigurationIsIdentifiedAnew) {
  ScriptedSensor s;
  ASSERT_TRUE(s.get_ready());
  const std::uint16_t crc = s.status.config_crc;
  s.status.config_crc = CTP_CONFIG_NONE;
  s.say_status();
  EXPECT_EQ(s.facts().step, ContactStep::kHello);
  EXPECT_EQ(s.facts().fault, ContactFault::kNone);
  s.status.config_crc = crc;
  EXPECT_TRUE(s.run_until([&] { return s.facts().step == ContactStep::kReady; }));
}

TEST(CoreIdentify, AClockThatJumpsIsIdentifiedAnewByName) {
  ScriptedSensor s;
  ASSERT_TRUE(s.get_ready());
  s.clock_off = 10s;
  ASSERT_TRUE(s.run_until([&] { return s.facts().fault == ContactFault::kClockJumped; }));
  ASSERT_TRUE(s.run_until([&] { return s.facts().step == ContactStep::kReady; }));
  EXPECT_EQ(s.facts().fault, ContactFault::kNone);
}

TEST(CoreIdentify, AClosedPortForgetsEverythingAndSendsNothing) {
  ScriptedSensor s;
  ASSERT_TRUE(s.get_ready());
  ASSERT_TRUE(s.arm(3, 1000ms));
  s.set(CTP_FLAG_CONTACT, true);
  s.say_status();
  s.core.disconnect(s.now);
  s.sent.clear();
  const ContactFacts facts = s.facts();
  EXPECT_EQ(facts.step, ContactStep::kClosed);
  EXPECT_EQ(facts.fault, ContactFault::kNone);
  EXPECT_EQ(facts.last_arm_end, ArmEnd::kLinkLost);
  EXPECT_FALSE(facts.armed || facts.self_test_ok);
  EXPECT_FALSE(facts.in_contact.has_value() || facts.loop_ok.has_value() ||
               facts.sense_v.has_value());
  EXPECT_FALSE(facts.quality.clock_sigma_s || facts.quality.clock_drift_ppm ||
               facts.quality.round_trip);
  EXPECT_EQ(s.core.next_wake(), TimePoint::max());
  s.core.self_test(s.now);
  s.core.on_tick(s.now);
  s.beats = false;
  s.run(1s);
  EXPECT_TRUE(s.sent.empty());
}

TEST(CoreIdentify, PingsOftenUntilTheMapIsGoodAndSeldomThenNeverEvenly) {
  ScriptedSensor s;
  s.core.connect(s.now);
  s.run(12s);
  const std::vector<double> gaps = gaps_ms(s.times(CTP_PING));
  ASSERT_GT(gaps.size(), 50u);
  std::size_t fast = 0;
  while (fast < gaps.size() && gaps[fast] < 100.0) ++fast;
  EXPECT_EQ(fast, 24u);
  const auto [f0, f1] = std::minmax_element(gaps.begin(), gaps.begin() + 23);
  EXPECT_GE(*f0, 10.0);
  EXPECT_LT(*f1, 21.5);
  EXPECT_GT(*f1 - *f0, 3.0);
  const auto [s0, s1] = std::minmax_element(gaps.begin() + 24, gaps.end());
  EXPECT_GE(*s0, 150.0);
  EXPECT_LT(*s1, 351.5);
  EXPECT_GT(*s1 - *s0, 50.0);
}

TEST(CoreIdentify, AnOldOrForeignPongIsNone) {
  ScriptedSensor s;
  ASSERT_TRUE(s.get_ready());
  s.pongs = false;
  s.sent.clear();
  ASSERT_TRUE(s.run_until([&] { return s.count(CTP_PING) == 1; }));
  const std::uint32_t nonce = ctp::read<ctp::Ping>(s.sent.back().frame).nonce;
  const double least = s.facts().quality.round_trip.value().min_s;
  s.say(ctp::Pong{nonce + 1, 0, 0});
  s.say(ctp::Pong{nonce, s.ticks(s.now), s.ticks(s.now)});
  for (int i = 0; i < 5; ++i)
    s.say(ctp::Pong{nonce, 0, 0});  // the same one again: no longer pending
  EXPECT_EQ(s.facts().step, ContactStep::kReady);
  EXPECT_LE(s.facts().quality.round_trip.value().min_s, least);
}

// Called only at its own wake-up times, the core behaves as if it were called continuously.
TEST(CoreIdentify, SaysWhenItWantsToBeCalled) {
  const auto life = [](bool always, auto&& script) {
    ScriptedSensor s;
    s.tick_always = always;
    s.core.connect(s.now);
    script(s);
    std::vector<std::pair<int, double>> done;
    for (const auto& sent : s.sent) {
      const double ms =
          std::chrono::duration<double, std::milli>(sent.at.time_since_epoch()).count();
      done.emplace_back(sent.frame.type, ms);
    }
    EXPECT_TRUE(always || s.wakes < 3000) << s.wakes;
    return done;
  };
  const auto expect_alike = [&](auto&& script) {
    const auto often = life(true, script), asked = life(false, script);
    ASSERT_EQ(often.size(), asked.size());
    for (std::size_t i = 0; i < often.size(); ++i) {
      EXPECT_EQ(often[i].first, asked[i].first) << i;
      EXPECT_NEAR(often[i].second, asked[i].second, 3.0) << i << " type " << often[i].first;
    }
  };
  expect_alike([](ScriptedSensor& s) {
    s.identifies = s.beats = false;
    s.run(1s);
  });
  expect_alike(
      [](ScriptedSensor& s) {  // the sensor's own bytes wake it only every tenth of a second
        s.beats = false;
        s.status.config_crc = CTP_CONFIG_NONE;
        s.run(1s);
      });
  expect_alike([](ScriptedSensor& s) {
    s.run(1s);
    s.core.arm(4, 300ms, s.now);
    s.run(200ms);
    s.beats = s.pongs = false;  // silent, under arm
    s.run(400ms);
  });
  expect_alike([](ScriptedSensor& s) {
    s.run(1s);
    s.arms = false;  // requested, but not answered
    s.core.arm(4, 300ms, s.now);
    s.beats = s.pongs = false;
    s.run(90ms);
  });
  expect_alike([](ScriptedSensor& s) {
    s.run(1s);
    s.tests = false;
    s.core.self_test(s.now);
    s.beats = s.pongs = false;
    s.run(400ms);
  });
}

}  // namespace
}  // namespace cellcal::drivers
