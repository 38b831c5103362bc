#pragma once
// Driver core and emulated sensor in virtual time, with a line that tests can damage.

#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "drivers/contact/serial_contact.h"
#include "sim/mcu/mcu_line.h"
#include "sim/mcu/mcu_thread.h"

namespace cellcal::drivers {

using std::chrono::microseconds;
using std::chrono::milliseconds;

/// Virtual time starts far from zero, as the machine's does.
inline constexpr TimePoint kStart{std::chrono::hours{30}};

/// Transit time of a message.
inline constexpr double kWireS = 180e-6;

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

inline ContactOptions over_ethernet() {
  ContactOptions options;
  options.datagrams = true;
  options.baud = sim::on_ethernet({}).baud;
  return options;
}

class VirtualClock : public Clock {
 public:
  TimePoint now() const override { return now_; }
  void sleep_until(TimePoint t) override { now_ = std::max(now_, t); }

 private:
  TimePoint now_ = kStart;
};

/// Forwards everything, or as modified by the test. An empty result: lost.
class DamagedLine : public ByteLine {
 public:
  using Damage = std::function<std::vector<std::uint8_t>(std::vector<std::uint8_t>)>;

  explicit DamagedLine(ByteLine& line) : line_(line) {}
  Damage to_sensor, to_host;
  int frames_to_sensor = 0, frames_to_host = 0;

  void write(std::span<const std::uint8_t> bytes, TimePoint t) override {
    ++frames_to_sensor;
    std::vector<std::uint8_t> copy(bytes.begin(), bytes.end());
    if (to_sensor) copy = to_sensor(copy);
    if (!copy.empty()) line_.write(copy, t);
  }
  TimePoint next() const override { return line_.next(); }
  void advance(TimePoint t) override { line_.advance(t); }
  std::size_t read(std::span<std::uint8_t> into, TimePoint& t) override {
    while (const std::size_t size = line_.read(into, t)) {
      ++frames_to_host;
      if (!to_host) return size;
      const auto out = to_host({into.begin(), into.begin() + static_cast<std::ptrdiff_t>(size)});
      if (out.empty()) continue;
      std::copy_n(out.begin(), std::min(out.size(), into.size()), into.begin());
      return std::min(out.size(), into.size());
    }
    return 0;
  }

 private:
  ByteLine& line_;
};

/// The type of a whole frame, or 0.
inline std::uint8_t type_of(const std::vector<std::uint8_t>& wire) {
  std::array<std::uint8_t, CTP_MAX_WIRE> raw{};
  if (wire.size() < CTP_OVERHEAD || wire.size() > raw.size()) return 0;
  const auto size = ctp::cobs_decode({wire.data(), wire.size() - 1}, raw.data());
  return size && *size > 0 ? raw[0] : std::uint8_t{0};
}

class Rig {
 public:
  explicit Rig(const sim::McuOptions& mcu_options = {}, const ContactOptions& options = {})
      : mcu(mcu_options, kStart - milliseconds{7}),
        mcu_line(mcu),
        line(mcu_line),
        contact(options, clock, line) {}

  TimePoint now() const { return clock.now(); }

  /// Advances time in cycles of the robot and collects events.
  void run(Duration d) {
    const TimePoint end = now() + d;
    while (now() < end) {
      clock.sleep_until(std::min(end, now() + milliseconds{1}));
      contact.run_until(now());
      while (const auto event = contact.guard().pop_event()) events.push_back(*event);
    }
  }

  bool run_until(const std::function<bool()>& done, Duration limit = std::chrono::seconds{3}) {
    const TimePoint end = now() + limit;
    while (!done()) {
      if (now() >= end) return false;
      run(milliseconds{1});
    }
    return true;
  }

  bool get_ready() {
    contact.open();
    return run_until([this] { return contact.status().link == ContactLink::kReady; });
  }

  ArmResult arm(std::uint16_t id, milliseconds lifetime = std::chrono::seconds{5}) {
    contact.arm(id, lifetime);
    std::optional<ArmResult> result;
    run_until([&] { return (result = contact.poll_arm()).has_value(); });
    EXPECT_TRUE(result.has_value()) << "no answer to the arming";
    return result.value_or(ArmResult{});
  }

  ContactSnapshot snapshot() { return contact.guard().snapshot(now()); }

  std::vector<ContactEvent> of_kind(ContactEventKind kind) const {
    std::vector<ContactEvent> found;
    for (const ContactEvent& e : events) {
      if (e.kind == kind) found.push_back(e);
    }
    return found;
  }

  VirtualClock clock;
  sim::Microcontroller mcu;
  sim::McuLine mcu_line;
  DamagedLine line;
  ContactInline contact;
  std::vector<ContactEvent> events;
};

inline double micro(Duration d) { return std::chrono::duration<double, std::micro>(d).count(); }

}  // namespace cellcal::drivers
