#pragma once
// The unmodified core of the driver and the firmware's image on a simulated board, in virtual time.

#include <algorithm>
#include <functional>
#include <optional>
#include <vector>

#include "drivers/contact/serial_contact.h"
#include "simavr_board.h"

namespace cellcal::test {

class SimavrBench {
 public:
  explicit SimavrBench(int baud = CTP_DEFAULT_BAUD)
      : board(CELLCAL_SENSOR_ELF, baud, kPowerOn),
        line_(board),
        contact(options_for(baud), clock_, line_) {}

  TimePoint now() const { return clock_.now(); }

  /// Advances time in cycles of the robot and collects events.
  void run(Duration d) {
    for (const TimePoint end = now() + d; now() < end;) {
      clock_.sleep_until(std::min(end, now() + kCycle));
      contact.run_until(now());
      while (const auto event = contact.guard().pop_event()) events.push_back(*event);
    }
  }
  bool run_until(const std::function<bool()>& done, Duration limit = std::chrono::seconds{3}) {
    for (const TimePoint end = now() + limit; !done();) {
      if (now() >= end) return false;
      run(kCycle);
    }
    return true;
  }
  bool get_ready() {
    contact.open();
    return run_until([this] { return contact.status().link == drivers::ContactLink::kReady; });
  }
  drivers::ArmResult arm(std::uint16_t id) {
    contact.arm(id, std::chrono::seconds{10});
    std::optional<drivers::ArmResult> result;
    run_until([&] { return (result = contact.poll_arm()).has_value(); });
    return result.value_or(drivers::ArmResult{});
  }
  int count(drivers::ContactEventKind kind) const {
    return static_cast<int>(std::count_if(events.begin(), events.end(),
                                          [kind](const auto& e) { return e.kind == kind; }));
  }

 private:
  static constexpr TimePoint kPowerOn{std::chrono::hours{30}};
  static constexpr std::chrono::microseconds kCycle{500};

  class VirtualClock : public drivers::Clock {
   public:
    TimePoint now() const override { return now_; }
    void sleep_until(TimePoint t) override { now_ = std::max(now_, t); }

   private:
    TimePoint now_ = kPowerOn;
  };

  static drivers::ContactOptions options_for(int baud) {
    drivers::ContactOptions options;
    options.baud = baud;
    return options;
  }

  VirtualClock clock_;

 public:
  SimavrBoard board;

 private:
  SimavrLine line_;

 public:
  drivers::ContactInline contact;
  std::vector<drivers::ContactEvent> events;
};

}  // namespace cellcal::test
