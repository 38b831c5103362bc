// The emulated sensor, which is the firmware's core, by itself: with manually built frames.

#include "sim/mcu/microcontroller.h"

#include <gtest/gtest.h>

#include <vector>

namespace cellcal::sim {
namespace {

namespace ctp = drivers::ctp;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr TimePoint kStart{std::chrono::hours{5}};

struct Heard {
  TimePoint t;
  ctp::Frame frame;
};

class Bench {
 public:
  explicit Bench(const McuOptions& options = {}) : mcu(options, kStart) {}

  template <class Payload>
  void say(const Payload& payload) {
    mcu.receive(ctp::build(payload, seq_++).bytes(), now);
  }
  void run(Duration d) {
    now += d;
    mcu.advance(now);
    while (const auto out = mcu.next_output()) {
      for (const std::uint8_t b : out->frame.bytes()) {
        if (const ctp::Frame* f = reader.feed(b)) heard.push_back({out->t, *f});
      }
    }
  }
  std::vector<Heard> of(std::uint8_t type) const {
    std::vector<Heard> found;
    for (const Heard& h : heard) {
      if (h.frame.type == type) found.push_back(h);
    }
    return found;
  }
  void get_ready() {
    say(ctp::Hello{1, 1, 42});
    say(ctp::Config{});
    say(ctp::SelfTest{});
    run(milliseconds{10});
    heard.clear();
  }
  void arm(std::uint16_t id, std::uint16_t lifetime_ms = 1000) {
    say(ctp::Arm{id, lifetime_ms});
    run(milliseconds{2});
    ASSERT_TRUE(mcu.armed());
    heard.clear();
  }
  /// Runs for d, keeping the sensor's dead man alive.
  void run_alive(Duration d) {
    for (const TimePoint end = now + d; now < end;) {
      say(ctp::KeepAlive{});
      run(milliseconds{10});
    }
  }

  Microcontroller mcu;
  TimePoint now = kStart;
  ctp::FrameReader reader{ctp::Direction::kFromSensor};
  std::vector<Heard> heard;

 private:
  std::uint8_t seq_ = 0;
};

TEST(Microcontroller, AnnouncesItselfAfterPowerOn) {
  Bench b;
  b.run(milliseconds{1});
  ASSERT_EQ(b.heard.size(), 1u);
  const auto ident = ctp::read<ctp::Ident>(b.heard[0].frame);
  EXPECT_EQ(ident.nonce, 0u);
  EXPECT_EQ(ident.version, CTP_VERSION);
  EXPECT_EQ(ident.config_crc, CTP_CONFIG_NONE);
}

TEST(Microcontroller, AnswersHelloWithItsNonceAndConfigWithItsCrc) {
  Bench b;
  b.run(milliseconds{1});
  b.heard.clear();
  b.say(ctp::Hello{1, 1, 4711});
  const ctp::Config config{CTP_CONTACT_IS_LOW, 7, 50, 5, 3000, 500};
  b.say(config);
  b.run(milliseconds{5});
  ASSERT_EQ(b.of(CTP_IDENT).size(), 1u);
  EXPECT_EQ(ctp::read<ctp::Ident>(b.of(CTP_IDENT)[0].frame).nonce, 4711u);
  ASSERT_FALSE(b.of(CTP_STATUS).empty());
  EXPECT_EQ(ctp::read<ctp::Status>(b.of(CTP_STATUS).back().frame).config_crc,
            ctp::config_crc(config));
}

TEST(Microcontroller, EveryByteTakesTenBitTimesInBothDirections) {
  for (const int baud : {1'000'000, 250'000, 115'200}) {
    McuOptions options;
    options.baud = baud;
    Bench b(options);
    b.run(milliseconds{50});
    b.heard.clear();
    const TimePoint sent = b.now;
    b.say(ctp::Ping{9});
    b.run(milliseconds{20});
    ASSERT_EQ(b.of(CTP_PONG).size(), 1u);
    const double wire_s = 18 * 10.0 / baud;
    const double took_s = std::chrono::duration<double>(b.of(CTP_PONG)[0].t - sent).count();
    EXPECT_NEAR(took_s, 2 * wire_s + 40e-6, 2e-6) << baud;
    const auto pong = ctp::read<ctp::Pong>(b.of(CTP_PONG)[0].frame);
    EXPECT_NEAR((pong.t_tx - pong.t_rx) / 2.0, 40.0, 1.0);
  }
}

TEST(Microcontroller, ATripOvertakesWhatIsQueuedAtTheNextFrameBoundary) {
  Bench b;
  b.get_ready();
  b.arm(5);
  for (int i = 0; i < 4; ++i) b.say(ctp::Ping{1});
  b.run(microseconds{800});  // the pongs are queued one after the other
  b.mcu.edge(b.now + microseconds{5}, true);
  b.run(milliseconds{3});
  ASSERT_EQ(b.of(CTP_TRIP).size(), 1u);
  const auto delay = b.of(CTP_TRIP)[0].t - (kStart + milliseconds{12} + microseconds{805});
  EXPECT_LE(delay, microseconds{180 + 120}) << "at most one PONG before it, and its own 12 bytes";
}

TEST(Microcontroller, StatusComesEvery100MillisecondsAndEvery10WhileArmed) {
  Bench b;
  b.get_ready();
  b.run(seconds{1});
  EXPECT_NEAR(static_cast<double>(b.of(CTP_STATUS).size()), 10.0, 1.0);
  b.arm(1, 5000);
  b.run_alive(seconds{1});
  EXPECT_NEAR(static_cast<double>(b.of(CTP_STATUS).size()), 100.0, 2.0);
}

TEST(Microcontroller, RepeatsAnEventEvery4MillisecondsUntilItIsAcknowledged) {
  Bench b;
  b.get_ready();
  b.arm(1);
  b.mcu.edge(b.now, true);
  b.run(milliseconds{42});
  const auto contacts = b.of(CTP_CONTACT);
  ASSERT_EQ(contacts.size(), 11u);
  const auto first = ctp::read<ctp::Event>(contacts[0].frame);
  for (std::size_t i = 1; i < contacts.size(); ++i) {
    EXPECT_GE(contacts[i].t - contacts[i - 1].t, milliseconds{CTP_REPEAT_MIN_MS});
    EXPECT_EQ(ctp::read<ctp::Event>(contacts[i].frame).event, first.event);
  }
  b.say(ctp::Ack{first.event});
  b.run(milliseconds{1});
  b.heard.clear();
  b.run(milliseconds{100});
  EXPECT_TRUE(b.of(CTP_CONTACT).empty());
}

TEST(Microcontroller, RepetitionsAreSlowerOnASlowLine) {
  McuOptions options;
  options.baud = 115'200;
  Bench b(options);
  b.say(ctp::Hello{1, 1, 42});
  b.say(ctp::Config{});
  b.run(milliseconds{20});
  b.mcu.edge(b.now, true);
  b.run(milliseconds{60});
  const auto contacts = b.of(CTP_CONTACT);
  ASSERT_GE(contacts.size(), 3u);
  // Three frames of 20 bytes, and the round trip of one and its 8 byte ACK: 7.6 ms.
  EXPECT_GE(contacts[2].t - contacts[1].t, microseconds{7600});
}

TEST(Microcontroller, TheStampIsThatOfTheFirstEdgeEvenIfItIsToldLate) {
  Bench b;
  b.get_ready();
  b.arm(1);
  const TimePoint past = b.now - microseconds{700};
  b.mcu.edge(past, true);
  b.run(milliseconds{2});
  ASSERT_EQ(b.of(CTP_TRIP).size(), 1u);
  EXPECT_EQ(ctp::read<ctp::Trip>(b.of(CTP_TRIP)[0].frame).t, b.mcu.ticks(past));
  ASSERT_FALSE(b.of(CTP_CONTACT).empty());
  EXPECT_EQ(ctp::read<ctp::Event>(b.of(CTP_CONTACT)[0].frame).t_first, b.mcu.ticks(past));
}

TEST(Microcontroller, EdgesAheadAreProcessedInTheOrderOfTheirTimes) {
  Bench b;
  b.get_ready();
  b.arm(1);
  b.mcu.edge(b.now + milliseconds{12}, false);
  b.mcu.edge(b.now + milliseconds{4}, true);
  b.run(milliseconds{3});
  EXPECT_TRUE(b.of(CTP_TRIP).empty());
  b.run(milliseconds{20});
  EXPECT_EQ(b.of(CTP_TRIP).size(), 1u);
  EXPECT_FALSE(b.of(CTP_CONTACT).empty());
  EXPECT_FALSE(b.of(CTP_RELEASE).empty());
}

TEST(Microcontroller, ConfirmationTakesTheConfiguredSamples) {
  Bench b;
  b.say(ctp::Hello{1, 1, 42});
  ctp::Config config;
  config.confirm_samples = 8;
  config.sample_us = 250;
  b.say(config);
  b.run(milliseconds{5});
  b.mcu.edge(b.now, true);
  b.run(milliseconds{10});
  ASSERT_FALSE(b.of(CTP_CONTACT).empty());
  EXPECT_EQ(ctp::read<ctp::Event>(b.of(CTP_CONTACT)[0].frame).dt_confirm_us, 2000);
}

TEST(Microcontroller, ARattleThatNeverSettlesIsNoise) {
  Bench b;
  b.get_ready();
  b.arm(1);
  TimePoint t = b.now;
  for (int i = 0; i < 400; ++i) {  // 80 ms of 100 us on, 100 us off
    b.mcu.edge(t, true);
    b.mcu.edge(t + microseconds{110}, false);
    t += microseconds{200};
  }
  b.run_alive(milliseconds{150});
  EXPECT_TRUE(b.of(CTP_CONTACT).empty());
  ASSERT_FALSE(b.of(CTP_REVOKED).empty());
  EXPECT_GT(ctp::read<ctp::Event>(b.of(CTP_REVOKED)[0].frame).bounces, 100);
}

struct Refused {
  const char* name;
  std::uint8_t reason;
  void (*spoil)(Bench&);
  ctp::Arm arm;
};

void PrintTo(const Refused& r, std::ostream* out) { *out << r.name; }

class MicrocontrollerRefuses : public testing::TestWithParam<Refused> {};

TEST_P(MicrocontrollerRefuses, WithTheReason) {
  Bench b;
  b.get_ready();
  GetParam().spoil(b);
  b.heard.clear();
  b.say(GetParam().arm);
  b.run(milliseconds{2});
  EXPECT_FALSE(b.mcu.armed());
  ASSERT_EQ(b.of(CTP_NAK).size(), 1u);
  const auto nak = ctp::read<ctp::Nak>(b.of(CTP_NAK)[0].frame);
  EXPECT_EQ(nak.of_type, CTP_ARM);
  EXPECT_EQ(nak.reason, GetParam().reason);
}

INSTANTIATE_TEST_SUITE_P(
    Arming, MicrocontrollerRefuses,
    testing::Values(Refused{"InContact",
                            CTP_NAK_IN_CONTACT,
                            [](Bench& b) {
                              b.mcu.edge(b.now, true);
                              b.run(milliseconds{5});
                            },
                            {1, 100}},
                    Refused{"LoopBroken",
                            CTP_NAK_LOOP_BROKEN,
                            [](Bench& b) {
                              McuFaults faults;
                              faults.circuit.sense_wire = TouchCircuit::kOpen;
                              b.mcu.set_faults(faults, b.now);
                              b.run(milliseconds{5});
                              b.say(ctp::SelfTest{});
                              b.run(milliseconds{10});
                            },
                            {1, 100}},
                    Refused{"VoltageUndefined",
                            CTP_NAK_VOLTAGE_UNDEFINED,
                            [](Bench& b) {
                              McuFaults faults;
                              faults.circuit.gun_to_earth = 670.0;  // 2.0 V
                              b.mcu.set_faults(faults, b.now);
                            },
                            {1, 100}},
                    Refused{"SelfTestOld",
                            CTP_NAK_SELF_TEST_OLD,
                            [](Bench& b) { b.run(seconds{CTP_SELF_TEST_MAX_AGE_S + 1}); },
                            {1, 100}},
                    Refused{"SelfTestNeverPassed",
                            CTP_NAK_SELF_TEST_OLD,
                            [](Bench& b) {
                              McuFaults faults;
                              faults.circuit.capture_joint_open = true;
                              b.mcu.set_faults(faults, b.now);
                              b.say(ctp::SelfTest{});
                              b.run(milliseconds{10});
                            },
                            {1, 100}},
                    Refused{"NoId", CTP_NAK_BAD_ARGUMENT, [](Bench&) {}, {0, 100}},
                    Refused{"NoLifetime", CTP_NAK_BAD_ARGUMENT, [](Bench&) {}, {1, 0}},
                    Refused{"UsedUp",
                            CTP_NAK_BAD_ARGUMENT,
                            [](Bench& b) {
                              b.arm(1);
                              b.say(ctp::Disarm{1});
                              b.run(milliseconds{2});
                            },
                            {1, 100}},
                    Refused{"NotGreetedSinceReset",
                            CTP_NAK_BAD_VERSION,
                            [](Bench& b) { b.mcu.reset(b.now); },
                            {1, 100}}),
    [](const auto& instance) { return std::string(instance.param.name); });

TEST(Microcontroller, DisarmsByItselfWithoutKeepAlive) {
  Bench b;
  b.get_ready();
  b.arm(1, 60'000);
  b.run_alive(milliseconds{500});
  EXPECT_TRUE(b.mcu.armed());
  b.run(milliseconds{CTP_KEEPALIVE_LIMIT_MS + 1});
  EXPECT_FALSE(b.mcu.armed());
}

TEST(Microcontroller, AResetTakesANewBootIdAndForgetsEverything) {
  Bench b;
  b.get_ready();
  b.arm(1);
  const std::uint32_t boot = b.mcu.boot_id();
  b.mcu.reset(b.now, CTP_RESET_WATCHDOG);
  b.run(milliseconds{2});
  EXPECT_FALSE(b.mcu.armed());
  ASSERT_EQ(b.of(CTP_IDENT).size(), 1u);
  const auto ident = ctp::read<ctp::Ident>(b.of(CTP_IDENT)[0].frame);
  EXPECT_EQ(ident.boot_id, boot + 1);
  EXPECT_EQ(ident.reset_cause, CTP_RESET_WATCHDOG);
  EXPECT_EQ(ident.config_crc, CTP_CONFIG_NONE);
}

TEST(Microcontroller, TheSameCallsGiveTheSameBytes) {
  const auto session = [] {
    Bench b;
    b.get_ready();
    b.arm(3);
    b.mcu.edge(b.now + microseconds{777}, true);
    b.run(milliseconds{30});
    std::vector<std::uint8_t> all;
    for (const Heard& h : b.heard) {
      all.push_back(h.frame.type);
      all.insert(all.end(), h.frame.payload.begin(), h.frame.payload.end());
    }
    return all;
  };
  EXPECT_EQ(session(), session());
}

TEST(Microcontroller, HowTimeIsCutDoesNotChangeWhatHappens) {
  const auto session = [](Duration step) {
    Bench b;
    b.get_ready();
    b.arm(3);
    b.mcu.edge(b.now + microseconds{777}, true);
    b.mcu.edge(b.now + microseconds{5777}, false);
    for (Duration d{}; d < milliseconds{60}; d += step) b.run(step);
    std::vector<std::pair<TimePoint, int>> all;
    for (const Heard& h : b.heard) all.emplace_back(h.t, h.frame.type);
    return all;
  };
  EXPECT_EQ(session(milliseconds{60}), session(microseconds{100}));
  EXPECT_EQ(session(milliseconds{60}), session(milliseconds{4}));
}

}  // namespace
}  // namespace cellcal::sim
