// The emulated microcontroller and the firmware's core hear the same and feel the same, and must
// say the same, byte by byte and at the same instants.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "drivers/contact/contact_words.h"
#include "sim/mcu/microcontroller.h"
#include "virtual_sensor.h"

namespace cellcal::test {
namespace {

namespace ctp = drivers::ctp;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;

constexpr TimePoint kStart{std::chrono::hours{5}};

struct Said {
  TimePoint t;
  std::vector<std::uint8_t> wire;
  bool operator==(const Said&) const = default;
};

void PrintTo(const Said& said, std::ostream* out) {
  *out << "at " << nanoseconds(said.t - kStart).count() << " ns:";
  std::array<std::uint8_t, CTP_MAX_WIRE> raw{};
  const auto size = ctp::cobs_decode({said.wire.data(), said.wire.size() - 1}, raw.data());
  for (std::size_t i = 0; size && i < *size; ++i)
    *out << ' ' << std::hex << int{raw[i]} << std::dec;
}

/// Both sensors side by side.
class Twins {
 public:
  explicit Twins(const sim::McuOptions& options) : emulated(options, kStart), own(options, kStart) {
    own.be_quiet();
  }

  template <class Payload>
  void say(const Payload& payload) {
    say_bytes(ctp::build(payload, seq_++).bytes());
  }
  void say_bytes(std::span<const std::uint8_t> bytes) {
    emulated.receive(bytes, now);
    own.receive(bytes, now);
  }
  void edge(TimePoint t, bool closed) {
    emulated.edge(t, closed);
    own.edge(t, closed);
  }
  void set_faults(const sim::McuFaults& faults) {
    emulated.set_faults(faults, now);
    own.set_faults(faults, now);
  }
  void reset() {
    emulated.reset(now, CTP_RESET_WATCHDOG);
    own.reset(now, CTP_RESET_WATCHDOG);
  }
  /// Lets both live for d; false and a message if they differ.
  bool run(Duration d) {
    now += d;
    const auto a = collect(emulated), b = collect(own);
    const auto [x, y] = std::mismatch(a.begin(), a.end(), b.begin(), b.end());
    if (x != a.end() || y != b.end()) {
      ADD_FAILURE() << "emulator: " << (x == a.end() ? "nothing" : testing::PrintToString(*x))
                    << "\nfirmware: " << (y == b.end() ? "nothing" : testing::PrintToString(*y));
    }
    for (const Said& said : a) hear(said);
    return a == b;
  }

  sim::Microcontroller emulated;
  VirtualSensor own;
  TimePoint now = kStart;
  std::vector<std::uint16_t> unacknowledged;
  std::array<int, 256> heard{};  ///< frames by type

 private:
  template <class Sensor>
  std::vector<Said> collect(Sensor& sensor) const {
    std::vector<Said> all;
    sensor.advance(now);
    while (const auto out = sensor.next_output()) {
      const auto bytes = out->frame.bytes();
      const std::vector<std::uint8_t> wire(bytes.begin(), bytes.end());
      all.push_back({out->t, wire});
    }
    return all;
  }
  void hear(const Said& said) {
    for (const std::uint8_t byte : said.wire) {
      const ctp::Frame* frame = reader_.feed(byte);
      if (frame == nullptr) continue;
      ++heard[frame->type];
      if (frame->type == CTP_CONTACT || frame->type == CTP_RELEASE || frame->type == CTP_REVOKED) {
        unacknowledged.push_back(ctp::read<ctp::Event>(*frame).event);
      }
    }
  }

  std::uint8_t seq_ = 0;
  ctp::FrameReader reader_{ctp::Direction::kFromSensor};
};

/// What a host and a world could do, in any order, sensible or not.
class Script {
 public:
  Script(Twins& twins, unsigned seed) : twins_(twins), random_(seed) {}

  bool run(int steps) {
    twins_.say(ctp::Hello{1, 1, 4711});
    twins_.say(ctp::Config{});
    for (int i = 0; i < steps; ++i) {
      if (draw(0, 9) == 0) {
        if (!self_test()) return false;
      } else {
        act();
      }
      if (!twins_.run(tick() * draw(0, draw(0, 3) == 0 ? 60'000 : 3'000))) return false;
    }
    return true;
  }

 private:
  static constexpr nanoseconds tick() { return nanoseconds{CTP_TICK_NS}; }
  int draw(int from, int to) { return std::uniform_int_distribution<int>(from, to)(random_); }
  std::uint16_t id() { return static_cast<std::uint16_t>(draw(0, 9)); }

  void act() {
    switch (draw(0, 19)) {
      case 0:
        twins_.say(ctp::Hello{static_cast<std::uint8_t>(draw(0, 2)), 2, 99});
        break;
      case 1:
        twins_.say(ctp::Config{CTP_CONTACT_IS_LOW, static_cast<std::uint8_t>(draw(0, 8)),
                               static_cast<std::uint16_t>(draw(0, 10) * 50),
                               static_cast<std::uint8_t>(draw(0, 20)), 3500,
                               static_cast<std::uint16_t>(draw(0, 4) == 0 ? 3600 : 1000)});
        break;
      case 2:
      case 3:
      case 4:
      case 5:
      case 6:
      case 7:
      case 8:
        twins_.say(ctp::Arm{next_arm_ = static_cast<std::uint16_t>(next_arm_ + draw(0, 1)),
                            static_cast<std::uint16_t>(draw(0, 9) == 0 ? 0 : draw(1, 300))});
        break;
      case 9:
        twins_.say(ctp::Disarm{draw(0, 1) == 0 ? next_arm_ : id()});
        break;
      case 10:
      case 11:
        acknowledge();
        break;
      case 12:
        twins_.say(ctp::Ping{static_cast<std::uint32_t>(random_())});
        break;
      case 13:
        twins_.say(ctp::KeepAlive{});
        break;
      case 14:
        garbage();
        break;
      case 15:
        fault();
        break;
      case 16:
        if (draw(0, 9) == 0) twins_.reset();
        break;
      default:
        touch();
        break;
    }
  }

  /// The circuit keeps still meanwhile: a real one is looked at in parts, the emulated one at the
  /// end.
  bool self_test() {
    if (!twins_.run(milliseconds{8})) return false;
    twins_.say(ctp::SelfTest{});
    if (draw(0, 2) == 0) twins_.say(ctp::SelfTest{});
    if (draw(0, 2) == 0) twins_.say(ctp::Arm{next_arm_, 100});
    return twins_.run(milliseconds{5});
  }

  void acknowledge() {
    for (const std::uint16_t event : twins_.unacknowledged) twins_.say(ctp::Ack{event});
    twins_.unacknowledged.clear();
  }

  void touch() {
    TimePoint t = twins_.now;
    closed_ = !closed_;
    for (int n = draw(0, 12); n > 0; --n) {
      twins_.edge(t += tick() * draw(1, 600), closed_);
      twins_.edge(t += tick() * draw(1, 600), !closed_);
    }
    twins_.edge(t + tick() * draw(1, 100), closed_);
    if (draw(0, 2) == 0) {
      closed_ = !closed_;
      twins_.edge(t + tick() * draw(101, 3000), closed_);
    }
  }

  void garbage() {
    std::array<std::uint8_t, 80> bytes{};
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(draw(0, 5) == 0 ? 0 : random_());
    twins_.say_bytes({bytes.data(), static_cast<std::size_t>(draw(1, 80))});
  }

  void fault() {
    sim::McuFaults faults;
    faults.wire_broken = draw(0, 3) == 0;
    faults.stuck_open = draw(0, 5) == 0;
    // Of voltages that no wiring can give, the firmware's self-test makes what it can, the emulated
    // one, which knows what is broken, does not look at them.
    if (!faults.wire_broken && draw(0, 3) == 0) {
      faults.sense_mv = static_cast<std::uint16_t>(draw(3500, 5000));
    }
    twins_.set_faults(faults);
  }

  Twins& twins_;
  std::mt19937 random_;
  std::uint16_t next_arm_ = 1;
  bool closed_ = false;
};

class Agreement : public testing::TestWithParam<int> {};

TEST_P(Agreement, EmulatorAndFirmwareAnswerAnyScriptWithTheSameFrames) {
  constexpr unsigned kScripts = 60;
  std::array<int, 256> heard{};
  for (unsigned seed = 0; seed < kScripts; ++seed) {
    sim::McuOptions options;
    options.baud = GetParam();
    options.first_ticks = seed % 3 == 0 ? 0xFFFFFFFFu - CTP_TICKS_PER_S : 0u;  // wraps within
    Twins twins(options);
    ASSERT_TRUE(Script(twins, seed).run(400)) << "seed " << seed;
    for (std::size_t i = 0; i < heard.size(); ++i) heard[i] += twins.heard[i];
  }
  for (const int type : {CTP_IDENT, CTP_STATUS, CTP_TRIP, CTP_CONTACT, CTP_PONG, CTP_NAK,
                         CTP_REVOKED, CTP_RELEASE}) {
    EXPECT_GT(heard[static_cast<std::size_t>(type)], 20) << "hardly tested: " << type;
  }
}

INSTANTIATE_TEST_SUITE_P(Baud, Agreement, testing::Values(1'000'000, 250'000));

}  // namespace
}  // namespace cellcal::test
