#pragma once
// The contact sensor in virtual time: the firmware's own core (drivers/contact/firmware/core) on an
// emulated board. The board consists of a touch circuit of resistors, a converter that samples its
// voltages in turn, a clock with drift, and a line on which every byte takes ten bit times in both
// directions. It has no clock and no thread of its own: it is deterministic.

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "drivers/contact/firmware/core/host_link.h"
#include "drivers/contact/firmware/core/sensor.h"
#include "drivers/contact/wire/ctp_codec.h"
#include "drivers/time.h"
#include "sim/mcu/touch_circuit.h"

namespace cellcal::sim {

using drivers::Duration;
using drivers::TimePoint;

struct McuOptions {
  int baud = CTP_DEFAULT_BAUD;
  bool relay = false;             ///< fitted in place of plug X1
  TouchBoard circuit = kUno;      ///< the board's components
  bool datagrams = false;         ///< the board on Ethernet; its `baud` is then the bit rate
  double drift_ppm = 0.0;         ///< rate of its clock relative to nominal
  std::uint32_t first_ticks = 0;  ///< clock at power on
  std::uint32_t uid = 0x4D435531;
  std::uint32_t boot_id = 1;  ///< the first; incremented at every reset
  std::uint8_t version = CTP_VERSION;
  std::array<std::uint8_t, 3> firmware{1, 1, 0};
  drivers::ctp::Board board{0xFF, 0xD7, 0xFC, 0xFFFF};  ///< as flashed by firmware/README.md
  std::chrono::microseconds turnaround{40};             ///< from a free line to a PONG's first bit
};

/// Faults, settable at any time.
struct McuFaults {
  /// The tip's contact is set by edges, the test pin by the firmware: both members are ignored
  /// here.
  TouchCircuit circuit = {};
  bool silent = false;        ///< hung: neither receives nor sends
  bool relay_welded = false;  ///< one of its poles stays closed
  bool relay_dead = false;    ///< its coil is open
};

class Microcontroller {
 public:
  Microcontroller(const McuOptions& options, TimePoint power_on);

  /// Contact or release of the tip at t, which may be in the future or slightly in the past; edges
  /// are processed in chronological order, and the stamp is always that of t.
  void edge(TimePoint t, bool closed);
  /// The host starts sending these bytes at t (or when the line is free).
  void receive(std::span<const std::uint8_t> bytes, TimePoint t);
  /// As a datagram from this address.
  void receive(std::span<const std::uint8_t> bytes, TimePoint t, const host_address& from);
  /// Runs until t.
  void advance(TimePoint t);
  /// Time of its next action, for the next advance().
  TimePoint next_event() const;

  struct Output {
    TimePoint t{};  ///< time of the last bit
    drivers::ctp::WireBytes frame;
    host_address to{};  ///< datagrams only
  };
  /// The next frame completely sent by the last advance().
  std::optional<Output> next_output();

  /// Output for a controller's input: reported immediately, and at each change from then on. The
  /// board clears it with the edge, not in its program's next turn: within 11 us, taken as 0.
  using OnOutput = std::function<void(TimePoint t, bool free)>;
  void on_output(OnOutput callback);

  void set_faults(const McuFaults& faults, TimePoint t);
  McuFaults faults() const { return {circuit_, silent_, relay_welded_, relay_dead_}; }
  /// Sets the clock's rate relative to nominal from t on, without a jump.
  void set_drift(double ppm, TimePoint t);
  /// Restarts at t: new boot id, clock from zero, no configuration, not armed.
  void reset(TimePoint t, std::uint8_t cause = CTP_RESET_PIN);

  // State for tests.
  bool relay_closed() const { return options_.relay && relay_pulled_; }
  bool armed() const { return sensor_.arm_id != 0; }
  std::uint32_t boot_id() const { return boot_id_; }
  std::uint32_t ticks(TimePoint t) const;
  std::uint64_t repeats() const { return repeats_ + sensor_.repeats; }
  const sensor& core() const { return sensor_; }
  const host_link& link() const { return link_; }
  bool datagrams() const { return options_.datagrams; }

 private:
  struct Arrival {
    TimePoint t{};
    std::uint8_t byte = 0;
  };

  struct Datagram {
    TimePoint t{};
    host_address from{};
    std::vector<std::uint8_t> bytes;
  };

  void boot(std::uint8_t cause);
  void hear(TimePoint t);
  void process(TimePoint t);
  TimePoint next_internal() const;
  TimePoint when(std::uint32_t wait) const;
  void run(TimePoint t);
  void transmit(TimePoint t);
  void settle(TimePoint t);
  void convert(TimePoint t);
  void examine_circuit(TimePoint t);
  void report_edge(TimePoint t);
  void move_gun(TimePoint t);
  void drive_relay(TimePoint t);
  void move_relay(TimePoint t);
  void follow_test();
  void follow_output(TimePoint t);
  Duration byte_time() const;

  McuOptions options_;
  TimePoint now_, clock_from_;  ///< of the clock: boot, or its last change of rate
  std::uint32_t first_ticks_, boot_id_;
  std::uint64_t repeats_ = 0;  ///< before the last reset
  sensor sensor_{};
  host_link link_{};
  bool silent_ = false;
  bool relay_welded_ = false, relay_dead_ = false, relay_pulled_ = false;
  TimePoint relay_at_ = TimePoint::max();  ///< end of the armature's motion

  OnOutput on_output_;
  bool free_ = false;  ///< last reported state of the output

  TouchCircuit circuit_;
  CircuitVoltages volts_;
  std::optional<double> gun_v_;  ///< of its capacitor, if it has one
  bool gun_moves_ = false;
  TimePoint gun_at_{};
  bool pin_high_ = true;
  bool seen_high_ = true;  ///< last level reported to the core
  /// Remaining conversions: the converter runs continuously, but repetitions of the same values are
  /// not simulated.
  int conversions_left_ = 0;
  TimePoint next_conversion_{};
  sensor_test last_test_ = TEST_NONE;
  bool last_armed_ = false;

  std::multimap<TimePoint, bool> edges_;  ///< stable for equal times
  std::deque<Arrival> arrivals_;
  std::deque<Datagram> datagrams_;
  TimePoint rx_free_, tx_free_;
  std::deque<Output> output_;
};

}  // namespace cellcal::sim
