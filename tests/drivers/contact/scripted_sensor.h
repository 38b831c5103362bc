#pragma once
// The core of the contact driver with a scripted sensor, frame by frame, in steps of a quarter of a
// millisecond.

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "drivers/contact/contact_core.h"

namespace cellcal::drivers {

class ScriptedSensor {
 public:
  static constexpr std::chrono::microseconds kStep{250};

  struct Sent {
    ctp::Frame frame;
    TimePoint at{};
  };

  explicit ScriptedSensor(const ContactOptions& given = {})
      : options(given), core(given, [this](std::span<const std::uint8_t> bytes) { take(bytes); }) {
    status.config_crc = ctp::config_crc(given.wire);
    status.flags = CTP_FLAG_LOOP_OK | CTP_FLAG_EARTH_OK;
    status.sense_mv = 5000;
  }

  /// Advances time; the core is called as by its owner: at its wake-up times, and for bytes.
  void run(Duration d) {
    for (const TimePoint end = now + d; now < end;) {
      now += kStep;
      if (tick_always || now >= core.next_wake()) {
        ++wakes;
        core.on_tick(now);
      }
      live();
      while (const auto event = core.pop_event()) events.push_back(*event);
    }
  }
  template <class Done>
  ::testing::AssertionResult run_until(Done done, Duration limit = std::chrono::seconds(5)) {
    for (const TimePoint end = now + limit; now < end;) {
      if (done()) return ::testing::AssertionSuccess();
      run(kStep);
    }
    return ::testing::AssertionFailure() << "not within the limit";
  }
  ::testing::AssertionResult get_ready() {
    core.connect(now);
    const auto ready = run_until([&] { return facts().step == ContactStep::kReady; });
    run(std::chrono::milliseconds(500));  // past the fast pings
    sent.clear();
    return ready;
  }
  ::testing::AssertionResult arm(std::uint16_t id, std::chrono::milliseconds lifetime) {
    core.arm(id, lifetime, now);
    std::optional<ArmAnswer> answer;
    if (!run_until([&] { return (answer = core.poll_arm()).has_value(); })) {
      return ::testing::AssertionFailure() << "no answer";
    }
    if (answer->refusal == ArmRefusal::kNone) return ::testing::AssertionSuccess();
    return ::testing::AssertionFailure() << "refused: " << static_cast<int>(answer->refusal);
  }
  /// The answer to an arming requested now.
  std::optional<ArmRefusal> refusal(std::uint16_t id, std::chrono::milliseconds lifetime) {
    core.arm(id, lifetime, now);
    std::optional<ArmAnswer> answer;
    EXPECT_TRUE(run_until([&] { return (answer = core.poll_arm()).has_value(); }));
    if (!answer) return std::nullopt;
    EXPECT_EQ(answer->arm_id, id);
    return answer->refusal;
  }

  ContactFacts facts() const { return core.facts(now); }
  ContactSnapshot snapshot() { return core.snapshot(now); }
  /// Transmission times of frames of this type.
  std::vector<TimePoint> times(std::uint8_t type) const {
    std::vector<TimePoint> found;
    for (const Sent& s : sent) {
      if (s.frame.type == type) found.push_back(s.at);
    }
    return found;
  }
  std::size_t count(std::uint8_t type) const { return times(type).size(); }

  template <class Payload>
  void say(const Payload& payload, std::uint8_t type) {
    core.on_bytes(ctp::build(payload, seq_++, type).bytes(), now);
  }
  template <class Payload>
  void say(const Payload& payload) {
    say(payload, Payload::kType);
  }
  void say_status() {
    status.t = ticks(now);
    say(status);
    next_status_ = now + std::chrono::milliseconds(10);
  }
  std::uint32_t ticks(TimePoint t) const {
    return static_cast<std::uint32_t>((t.time_since_epoch() + clock_off) /
                                      std::chrono::nanoseconds(500));
  }
  void set(std::uint8_t flag, bool on) {
    status.flags = static_cast<std::uint8_t>(on ? status.flags | flag : status.flags & ~flag);
  }

  ContactOptions options;
  ContactCore core;
  TimePoint now{std::chrono::hours(5)};
  std::vector<Sent> sent;
  std::vector<ContactEvent> events;
  int wakes = 0;
  bool tick_always = false;

  // Autonomous behaviour.
  bool identifies = true, beats = true, pongs = true, tests = true, passes = true, arms = true,
       disarms = true;
  std::uint8_t nak_hello = 0, nak_config = 0, nak_arm = 0;
  ctp::Ident ident{CTP_VERSION, {1, 2, 3}, 0x11223344, 7, 16'000'000, 1, 0, CTP_CONFIG_NONE};
  ctp::Status status;
  Duration clock_off{0};

 private:
  void take(std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) {
      const ctp::Frame* frame = reader_.feed(byte);
      if (frame != nullptr) sent.push_back({*frame, now});
      if (frame != nullptr) heard_.push_back(*frame);
    }
  }
  void live() {
    const std::vector<ctp::Frame> frames = std::exchange(heard_, {});
    for (const ctp::Frame& frame : frames) on_frame(frame);
    if (test_ends_ && now >= *test_ends_) {
      test_ends_.reset();
      set(CTP_FLAG_SELF_TEST_OK, passes);
      if (beats) say_status();
    }
    if (beats && now >= next_status_) say_status();
  }
  void on_frame(const ctp::Frame& frame) {
    if (frame.type == CTP_HELLO && nak_hello != 0) say(ctp::Nak{CTP_HELLO, nak_hello});
    if (frame.type == CTP_HELLO && identifies) {
      ident.nonce = ctp::read<ctp::Hello>(frame).nonce;
      say(ident);
    }
    if (frame.type == CTP_CONFIG && nak_config != 0) say(ctp::Nak{CTP_CONFIG, nak_config});
    if (frame.type == CTP_PING && pongs) {
      say(ctp::Pong{ctp::read<ctp::Ping>(frame).nonce, ticks(now), ticks(now)});
    }
    if (frame.type == CTP_SELFTEST && tests) {
      set(CTP_FLAG_SELF_TEST_OK, false);
      if (beats) say_status();
      test_ends_ = now + std::chrono::milliseconds(3);
    }
    if (frame.type == CTP_ARM && nak_arm != 0) say(ctp::Nak{CTP_ARM, nak_arm});
    if (frame.type == CTP_ARM && arms && nak_arm == 0) {
      set(CTP_FLAG_ARMED, true);
      set(CTP_FLAG_LATCHED, false);
      if (beats) say_status();
    }
    if (frame.type == CTP_DISARM && disarms) {
      set(CTP_FLAG_ARMED, false);
      if (beats) say_status();
    }
  }

  ctp::FrameReader reader_{ctp::Direction::kFromHost};
  std::vector<ctp::Frame> heard_;
  TimePoint next_status_{};
  std::optional<TimePoint> test_ends_;
  std::uint8_t seq_ = 0;
};

/// Milliseconds between successive times.
inline std::vector<double> gaps_ms(const std::vector<TimePoint>& times) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < times.size(); ++i) {
    gaps.push_back(std::chrono::duration<double, std::milli>(times[i] - times[i - 1]).count());
  }
  return gaps;
}

inline void expect_every(const std::vector<TimePoint>& times, double ms, std::size_t at_least) {
  EXPECT_GE(times.size(), at_least);
  for (const double gap : gaps_ms(times)) EXPECT_NEAR(gap, ms, 0.3);
}

}  // namespace cellcal::drivers
