#pragma once
// The firmware's core on a board in virtual time: a touch circuit, a clock that may drift, and a
// wire on which every byte takes ten bit times. It answers to the same calls as
// sim::Microcontroller, so that the same tests hold the emulated sensor and the firmware to the
// same promises.

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>

#include "drivers/contact/byte_line.h"
#include "drivers/contact/firmware/core/sensor.h"
#include "sim/mcu/microcontroller.h"

namespace cellcal::test {

using drivers::Duration;
using drivers::TimePoint;

class VirtualSensor {
 public:
  using Output = sim::Microcontroller::Output;

  VirtualSensor(const sim::McuOptions& options, TimePoint power_on);

  void edge(TimePoint t, bool closed) { edges_.emplace(t, closed); }
  void receive(std::span<const std::uint8_t> bytes, TimePoint t);
  void advance(TimePoint t);
  TimePoint next_event() const;
  std::optional<Output> next_output();
  void set_faults(const sim::McuFaults& faults, TimePoint t);
  const sim::McuFaults& faults() const { return faults_; }
  /// Only the sense wire, or only the feed wire, breaks: both read as contact.
  void break_wires(bool feed_wire, bool sense_wire, TimePoint t);
  void reset(TimePoint t, std::uint8_t cause = CTP_RESET_PIN);

  bool armed() const { return sensor_.arm_id != 0; }
  std::uint32_t boot_id() const { return boot_id_; }
  std::uint32_t ticks(TimePoint t) const;
  std::uint64_t repeats() const { return sensor_.repeats; }
  const sensor& core() const { return sensor_; }
  /// No LOG from now on: the emulated sensor has none.
  void be_quiet() { quiet_ = true; }

 private:
  struct Arrival {
    TimePoint t{};
    std::uint8_t byte = 0;
  };

  void boot(std::uint8_t cause);
  void process(TimePoint t);
  TimePoint next_internal() const;
  TimePoint when(std::uint32_t wait) const;
  void measure();
  void follow_pin(TimePoint t);
  void run(TimePoint t);
  void transmit(TimePoint t);
  bool closed_at_pin() const;
  Duration byte_time() const;

  sim::McuOptions options_;
  sim::McuFaults faults_;
  bool feed_broken_ = false, sense_broken_ = false, quiet_ = false;
  TimePoint now_, booted_;
  std::uint32_t first_ticks_, boot_id_;
  sensor sensor_{};
  bool closed_ = false;   ///< truth
  bool pin_high_ = true;  ///< as the core last heard

  std::multimap<TimePoint, bool> edges_;  ///< equal times keep the order they came in
  std::deque<Arrival> arrivals_;
  TimePoint rx_free_, tx_free_;
  std::deque<Output> output_;
};

class VirtualSensorLine : public drivers::ByteLine {
 public:
  explicit VirtualSensorLine(VirtualSensor& peer) : peer_(peer) {}

  void write(std::span<const std::uint8_t> bytes, TimePoint t) override { peer_.receive(bytes, t); }
  TimePoint next() const override { return peer_.next_event(); }
  void advance(TimePoint t) override { peer_.advance(t); }
  std::size_t read(std::span<std::uint8_t> into, TimePoint& t) override;

 private:
  VirtualSensor& peer_;
};

}  // namespace cellcal::test
