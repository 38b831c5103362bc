// The firmware's core on the emulated board: behaviour that is hardly visible to a host.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "sim/mcu/microcontroller.h"

namespace cellcal::test {
namespace {

namespace ctp = drivers::ctp;
using drivers::Duration;
using drivers::TimePoint;
using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr TimePoint kStart{std::chrono::hours{5}};

struct Bench {
  explicit Bench(const sim::McuOptions& options = {}) : peer(options, kStart) {}

  template <class Payload>
  void say(const Payload& payload) {
    peer.receive(ctp::build(payload, seq++).bytes(), now);
  }
  void run(Duration d) {
    peer.advance(now += d);
    while (const auto out = peer.next_output()) {
      for (const std::uint8_t b : out->frame.bytes()) {
        if (const ctp::Frame* f = reader.feed(b)) heard.push_back(*f);
      }
    }
  }
  std::vector<ctp::Frame> of(std::uint8_t type) const {
    std::vector<ctp::Frame> found;
    std::copy_if(heard.begin(), heard.end(), std::back_inserter(found),
                 [type](const ctp::Frame& f) { return f.type == type; });
    return found;
  }
  ctp::Status last_status() const { return ctp::read<ctp::Status>(of(CTP_STATUS).back()); }
  void get_ready(const ctp::Config& config = {}) {
    say(ctp::Hello{1, 1, 42});
    say(config);
    say(ctp::SelfTest{});
    run(milliseconds{10});
    heard.clear();
  }

  sim::Microcontroller peer;
  TimePoint now = kStart;
  ctp::FrameReader reader{ctp::Direction::kFromSensor};
  std::vector<ctp::Frame> heard;
  std::uint8_t seq = 0;
};

// The touch circuit -------------------------------------------------------------------------------

struct Wires {
  const char* name;
  bool feed, sense, touching, whole;
};

void PrintTo(const Wires& w, std::ostream* out) { *out << w.name; }

class FirmwareLoop : public testing::TestWithParam<Wires> {};

TEST_P(FirmwareLoop, ABreakReadsAsContactAndTheSelfTestTellsItFromATouch) {
  Bench b;
  b.get_ready();
  b.say(ctp::Arm{1, 1000});
  b.run(milliseconds{1});
  sim::McuFaults faults;
  if (GetParam().feed) faults.circuit.feed_wire = sim::TouchCircuit::kOpen;
  if (GetParam().sense) faults.circuit.sense_wire = sim::TouchCircuit::kOpen;
  b.peer.set_faults(faults, b.now);
  if (GetParam().touching) b.peer.edge(b.now, true);
  b.run(milliseconds{3});
  EXPECT_EQ(b.of(CTP_TRIP).size(), 1u);
  EXPECT_FALSE(b.of(CTP_CONTACT).empty());
  b.say(ctp::SelfTest{});
  b.run(milliseconds{10});
  EXPECT_EQ((b.last_status().flags & CTP_FLAG_LOOP_OK) != 0, GetParam().whole);
  EXPECT_NE(b.last_status().flags & CTP_FLAG_CONTACT, 0);
  b.heard.clear();
  b.say(ctp::Arm{2, 1000});
  b.run(milliseconds{1});
  ASSERT_EQ(b.of(CTP_NAK).size(), 1u);
  EXPECT_EQ(ctp::read<ctp::Nak>(b.of(CTP_NAK)[0]).reason,
            GetParam().whole ? CTP_NAK_IN_CONTACT : CTP_NAK_LOOP_BROKEN);
}

INSTANTIATE_TEST_SUITE_P(Each, FirmwareLoop,
                         testing::Values(Wires{"Touch", false, false, true, true},
                                         Wires{"FeedWire", true, false, false, false},
                                         Wires{"SenseWire", false, true, false, false},
                                         Wires{"FeedWireInTouch", true, false, true, false},
                                         Wires{"SenseWireInTouch", false, true, true, false}),
                         [](const auto& instance) { return std::string(instance.param.name); });

TEST(FirmwareSensor, ATouchThatEndsInMidSelfTestIsNoBreak) {
  for (int us = 50; us < 2000; us += 50) {
    Bench b;
    b.get_ready();
    b.peer.edge(b.now, true);
    b.run(milliseconds{5});
    b.say(ctp::SelfTest{});
    b.peer.edge(b.now + microseconds{60 + us}, false);
    b.run(milliseconds{10});
    EXPECT_NE(b.last_status().flags & CTP_FLAG_LOOP_OK, 0) << us;
    EXPECT_EQ(b.last_status().flags & CTP_FLAG_CONTACT, 0) << us;
    EXPECT_FALSE(b.of(CTP_RELEASE).empty()) << us;
  }
}

TEST(FirmwareSensor, AnInputThatIsStuckOpenFailsTheSelfTestThoughTheLoopIsWhole) {
  Bench b;
  b.peer.set_faults({.circuit = {.capture_joint_open = true}}, b.now);
  b.get_ready();
  b.run(milliseconds{200});
  EXPECT_NE(b.last_status().flags & CTP_FLAG_LOOP_OK, 0);
  EXPECT_EQ(b.last_status().flags & CTP_FLAG_SELF_TEST_OK, 0);
}

TEST(FirmwareSensor, AVoltageInTheContactBandIsContactWhateverThePinSays) {
  Bench b;
  b.get_ready();
  b.peer.set_faults({.circuit = {.gun_to_earth = 60.0, .capture_joint_open = true}}, b.now);
  b.say(ctp::Arm{1, 1000});
  b.run(milliseconds{2});
  ASSERT_EQ(b.of(CTP_NAK).size(), 1u);
  EXPECT_EQ(ctp::read<ctp::Nak>(b.of(CTP_NAK)[0]).reason, CTP_NAK_IN_CONTACT);
}

TEST(FirmwareSensor, WithContactHighTheLevelsAreMirrored) {
  sim::McuOptions options;
  Bench b(options);
  b.say(ctp::Hello{1, 1, 42});
  ctp::Config config;
  config.polarity = CTP_CONTACT_IS_HIGH;
  b.say(config);
  b.run(milliseconds{5});
  ASSERT_FALSE(b.of(CTP_CONTACT).empty()) << "the open loop is high, which is contact now";
  b.peer.edge(b.now, true);
  b.run(milliseconds{5});
  EXPECT_FALSE(b.of(CTP_RELEASE).empty());
}

// Arming and time ---------------------------------------------------------------------------------

TEST(FirmwareSensor, TheTripDoesNotWaitForTheConfirmation) {
  Bench b;
  ctp::Config slow;
  slow.confirm_samples = 10;
  slow.sample_us = 1000;
  b.get_ready(slow);
  b.say(ctp::Arm{1, 1000});
  b.run(milliseconds{2});
  b.peer.edge(b.now, true);
  b.run(microseconds{200});
  EXPECT_EQ(b.of(CTP_TRIP).size(), 1u);
  EXPECT_TRUE(b.of(CTP_CONTACT).empty());
}

TEST(FirmwareSensor, SamplesAreOfTheEdgesHistoryHoweverLateTheyAreLookedAt) {
  touch_rule rule{5, 200, 100'000};
  touch_state touch{};
  // Closed except for the second 100 us: samples are taken from the history.
  EXPECT_TRUE(touch_edge(&touch, &rule, 1000, true));
  std::vector<touch_outcome> outcomes;
  const std::vector<std::pair<std::uint32_t, bool>> edges = {{1250, false}, {1450, true}};
  for (const auto& [t, closed] : edges) {
    while (static_cast<std::int32_t>(touch.sample - t) <= 0) {
      outcomes.push_back(touch_sample(&touch, &rule));
    }
    EXPECT_FALSE(touch_edge(&touch, &rule, t, closed));
  }
  while (touch.open) outcomes.push_back(touch_sample(&touch, &rule));
  EXPECT_EQ(outcomes.size(), 7u) << "hit, miss, then five hits";
  EXPECT_EQ(outcomes.back(), TOUCH_CONFIRMED);
  EXPECT_EQ(touch.bounces, 1);
}

TEST(FirmwareSensor, DeadlinesHoldAcrossTheWrapOfItsClock) {
  for (const std::uint32_t before : {1u, 5'000u, 150'000u, 250'000u}) {  // ticks before the wrap
    sim::McuOptions options;
    options.first_ticks = 0u - before;
    Bench b(options);
    b.get_ready();
    b.say(ctp::Arm{1, 60'000});
    b.run(milliseconds{CTP_KEEPALIVE_LIMIT_MS - 1});
    EXPECT_TRUE(b.peer.armed()) << before;
    b.run(milliseconds{3});
    EXPECT_FALSE(b.peer.armed()) << before;
    b.heard.clear();
    b.run(std::chrono::seconds{1});
    EXPECT_NEAR(static_cast<double>(b.of(CTP_STATUS).size()), 10.0, 1.0) << before;
  }
}

TEST(FirmwareSensor, ASelfTestStaysOldWhenItsAgeHasWrapped) {
  Bench b;
  b.get_ready();
  // Its clock wraps after 36 minutes; an age modulo that would be small again.
  for (int minute = 0; minute < 37; ++minute) b.run(std::chrono::minutes{1});
  b.heard.clear();
  b.say(ctp::Arm{1, 100});
  b.run(milliseconds{2});
  ASSERT_EQ(b.of(CTP_NAK).size(), 1u);
  EXPECT_EQ(ctp::read<ctp::Nak>(b.of(CTP_NAK)[0]).reason, CTP_NAK_SELF_TEST_OLD);
}

TEST(FirmwareSensor, RefusesConfigurationsThatCannotWork) {
  const std::vector<ctp::Config> senseless = {
      {2, 5, 100, 10, 3500, 1000},      // polarity
      {0, 0, 100, 10, 3500, 1000},      // no samples
      {0, 5, 0, 10, 3500, 1000},        // no time between them
      {0, 5, 100, 0, 3500, 1000},       // no heartbeat
      {0, 5, 100, 10, 1000, 1000},      // no band between open and contact
      {0, 255, 60'000, 10, 3500, 1000}  // never confirmed
  };
  Bench b;
  b.say(ctp::Hello{1, 1, 42});
  for (std::size_t i = 0; i < senseless.size(); ++i) {
    b.say(senseless[i]);
    b.run(milliseconds{2});
    ASSERT_EQ(b.of(CTP_NAK).size(), i + 1);
    EXPECT_EQ(ctp::read<ctp::Nak>(b.of(CTP_NAK)[i]).reason, CTP_NAK_BAD_ARGUMENT);
  }
  b.run(milliseconds{200});
  EXPECT_EQ(b.last_status().config_crc, CTP_CONFIG_NONE);
}

TEST(FirmwareSensor, SpeaksOnlyToHostsOfItsVersion) {
  Bench b;
  b.say(ctp::Hello{2, 5, 42});
  b.say(ctp::Config{});
  b.run(milliseconds{3});
  ASSERT_EQ(b.of(CTP_NAK).size(), 2u);
  EXPECT_EQ(ctp::read<ctp::Nak>(b.of(CTP_NAK)[0]).of_type, CTP_HELLO);
  EXPECT_EQ(ctp::read<ctp::Nak>(b.of(CTP_NAK)[1]).of_type, CTP_CONFIG);
  EXPECT_EQ(ctp::read<ctp::Nak>(b.of(CTP_NAK)[1]).reason, CTP_NAK_BAD_VERSION);
}

// Transmission ------------------------------------------------------------------------------------

TEST(FirmwareSensor, TellsOfAnEventThatNobodyAcknowledgedAndKeepsTheNewest) {
  Bench b;
  b.get_ready();
  for (int i = 0; i < SENSOR_EVENTS + 2; ++i) {
    b.peer.edge(b.now, i % 2 == 0);
    b.run(milliseconds{2});
  }
  b.run(milliseconds{300});
  EXPECT_EQ(b.peer.core().event_count, SENSOR_EVENTS);
  EXPECT_EQ(b.peer.core().lost_events, 2);
  ASSERT_FALSE(b.of(CTP_LOG).empty());
  const ctp::Frame log = b.of(CTP_LOG).front();
  EXPECT_NE(std::string(log.payload.begin(), log.payload.begin() + log.size).find("acknowledged"),
            std::string::npos);
}

TEST(FirmwareSensor, APingAmongBouncesIsNotAnswered) {
  sensor s{};
  sensor_identity identity{};
  identity.version = CTP_VERSION;
  identity.baud = CTP_DEFAULT_BAUD;
  identity.ping_guard = 400;
  sensor_init(&s, &identity, 0);
  std::array<std::uint8_t, CTP_MAX_WIRE> wire{};
  std::uint32_t start = 0;
  while (sensor_next_frame(&s, 0, wire.data(), &start) > 0) continue;  // IDENT
  const auto answered = [&](std::uint32_t t) {
    const ctp::WireBytes ping = ctp::build(ctp::Ping{7}, 0);
    for (const std::uint8_t b : ping.bytes()) sensor_on_byte(&s, b, t);
    return sensor_next_frame(&s, t, wire.data(), &start) > 0;
  };
  sensor_on_edge(&s, 10'000, false);
  EXPECT_FALSE(answered(10'050));
  EXPECT_FALSE(answered(10'399));
  EXPECT_TRUE(answered(10'401));
}

TEST(FirmwareSensor, AnyBytesLeaveItWithinItsBoundsAndUnarmed) {
  std::mt19937 random(17);
  Bench b;
  for (int i = 0; i < 4000; ++i) {
    std::array<std::uint8_t, 60> bytes{};
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random() % 4 == 0 ? 0 : random());
    b.peer.receive(bytes, b.now);
    b.peer.edge(b.now + microseconds{random() % 900}, random() % 2 == 0);
    b.run(milliseconds{1});
    b.heard.clear();
    const sensor& s = b.peer.core();
    ASSERT_LE(s.event_count, SENSOR_EVENTS);
    ASSERT_LE(s.nak_count, SENSOR_NAKS);
    ASSERT_LE(s.pong_count, SENSOR_PONGS);
    ASSERT_FALSE(b.peer.armed());
  }
}

}  // namespace
}  // namespace cellcal::test
