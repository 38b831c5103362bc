// Bytes that no genuine sensor sends. The core must remain consistent: no unrequested arming, no
// invalid event time, and it must recover with the genuine sensor.

#include <cmath>
#include <random>

#include "rig.h"

namespace cellcal::drivers {
namespace {

std::vector<std::uint8_t> valid_frame(std::mt19937& random, std::uint8_t seq) {
  constexpr std::array kTypes = {CTP_IDENT, CTP_STATUS, CTP_TRIP,    CTP_CONTACT, CTP_PONG,
                                 CTP_NAK,   CTP_LOG,    CTP_REVOKED, CTP_RELEASE};
  const auto type = static_cast<std::uint8_t>(kTypes[random() % kTypes.size()]);
  const int size = ctp_payload_size(type);
  std::vector<std::uint8_t> payload(size < 0 ? random() % (CTP_MAX_PAYLOAD + 1)
                                             : static_cast<std::size_t>(size));
  for (auto& b : payload) b = static_cast<std::uint8_t>(random());
  const auto wire = ctp::build_frame(type, seq, payload);
  return {wire.bytes().begin(), wire.bytes().end()};
}

TEST(ContactHostile, RandomBytesNeverMakeItReadyOrArmed) {
  std::mt19937 random(7);
  ContactCore core({}, [](std::span<const std::uint8_t>) {});
  TimePoint now = kStart;
  core.connect(now);
  for (int i = 0; i < 20'000; ++i) {
    std::array<std::uint8_t, 64> bytes{};
    for (auto& b : bytes) b = static_cast<std::uint8_t>(random());
    now += milliseconds{1};
    core.on_bytes(bytes, now);
    core.on_tick(now);
    ASSERT_FALSE(core.snapshot(now).alive);
    ASSERT_FALSE(core.snapshot(now).armed);
  }
  EXPECT_GT(core.facts(now).quality.crc_errors, 100u);
}

TEST(ContactHostile, ValidFramesOfNonsenseLeaveItFiniteAndUnarmed) {
  std::mt19937 random(11);
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  ContactCore core({}, [](std::span<const std::uint8_t>) {});
  TimePoint now = kStart;
  core.connect(now);
  for (int i = 0; i < 50'000; ++i) {
    now += microseconds{random() % 3000};
    core.on_bytes(valid_frame(random, static_cast<std::uint8_t>(i)), now);
    core.on_tick(now);
    ASSERT_FALSE(core.snapshot(now).armed);
    while (const auto e = core.pop_event()) {
      ASSERT_TRUE(std::isfinite(e->time_sigma_s));
      ASSERT_GT(e->time_sigma_s, 0.0);
      ASSERT_LE(e->first_edge, now + milliseconds{2});
    }
    ASSERT_GT(core.next_wake(), TimePoint{});
  }
}

TEST(ContactHostile, NonsenseBetweenTheRealFramesDoesNotArmOrStayAlive) {
  // The genuine sensor sends, mixed with valid frames of random content from a second source.
  std::mt19937 random(5);
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  int n = 0;
  rig.line.to_host = [&](std::vector<std::uint8_t> wire) {
    return ++n % 3 == 0 ? valid_frame(random, static_cast<std::uint8_t>(n)) : wire;
  };
  rig.run(std::chrono::seconds{20});
  EXPECT_FALSE(rig.snapshot().armed);
  rig.line.to_host = nullptr;
  rig.contact.self_test();  // in case a restart was reported
  EXPECT_TRUE(rig.run_until([&] { return rig.contact.status().link == ContactLink::kReady; },
                            std::chrono::seconds{10}))
      << rig.contact.status().words;
  EXPECT_TRUE(rig.arm(1).armed);
}

TEST(ContactHostile, AnEdgeFromTheFutureIsNotBelieved) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  rig.run(std::chrono::seconds{3});
  bool done = false;
  rig.line.to_host = [&](std::vector<std::uint8_t> wire) {
    if (done) return wire;
    done = true;
    ctp::Event event;
    event.event = 999;
    event.t_first = rig.mcu.ticks(rig.now() + std::chrono::seconds{5});
    const auto forged = ctp::build(event, 0, CTP_CONTACT);
    return std::vector<std::uint8_t>(forged.bytes().begin(), forged.bytes().end());
  };
  rig.run(milliseconds{200});
  ASSERT_EQ(rig.events.size(), 1u);
  EXPECT_LE(rig.events[0].first_edge, rig.now());
  EXPECT_GT(rig.events[0].time_sigma_s, 4.0) << "its time is worth nothing, and it says so";
}

TEST(ContactHostile, ASensorArmedByNobodyIsToldToLetGo) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  const auto forged = ctp::build(ctp::Arm{321, 60'000}, 77);
  rig.mcu.receive(forged.bytes(), rig.now());
  rig.run(milliseconds{60});
  EXPECT_FALSE(rig.snapshot().armed);
  rig.run(milliseconds{CTP_KEEPALIVE_LIMIT_MS + 60});
  EXPECT_FALSE(rig.mcu.armed()) << "by itself, at the latest";
}

TEST(ContactHostile, RandomBytesDoNotArmTheSensor) {
  std::mt19937 random(13);
  sim::Microcontroller mcu({}, kStart);
  TimePoint now = kStart;
  for (int i = 0; i < 5'000; ++i) {
    std::array<std::uint8_t, 40> bytes{};
    for (auto& b : bytes) b = static_cast<std::uint8_t>(random());
    mcu.receive(bytes, now);
    now += milliseconds{1};
    mcu.advance(now);
    while (mcu.next_output()) continue;
    ASSERT_FALSE(mcu.armed());
  }
}

}  // namespace
}  // namespace cellcal::drivers
