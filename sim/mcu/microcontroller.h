#pragma once
// The contact sensor in virtual time: the firmware's own core (drivers/contact/firmware/core) on an
// emulated board. Board means a touch circuit of resistors, a converter that looks at its voltages
// in turn, a clock that may drift, and a wire on which every byte takes ten bit times in both
// directions. It has no clock and no thread of its own: the same calls give the same bytes.

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
  bool relay = false;  ///< fitted in the place of plug X1
  TouchBoard circuit = kUno;  ///< as the board's own parts make it
  bool datagrams = false;  ///< the board on Ethernet; its `baud` is then the wire's bit rate
  double drift_ppm = 0.0;         ///< how much faster than nominal its clock runs
  std::uint32_t first_ticks = 0;  ///< of its clock at power on
  std::uint32_t uid = 0x4D435531;
  std::uint32_t boot_id = 1;  ///< the first; every reset takes the next
  std::uint8_t version = CTP_VERSION;
  std::array<std::uint8_t, 3> firmware{1, 1, 0};
  drivers::ctp::Board board{0xFF, 0xD7, 0xFC, 0xFFFF};  ///< as firmware/README.md flashes it
  std::chrono::microseconds turnaround{40};             ///< line free for a PONG to its first bit
};

/// What is wrong with it. All settable at any time.
struct McuFaults {
  /// Whether the tip touches is the edges' affair, what the test pin does the firmware's: neither
  /// is taken from here.
  TouchCircuit circuit = {};
  bool silent = false;  ///< hangs: neither hears nor speaks
  bool relay_welded = false;  ///< one of its poles does not open any more
  bool relay_dead = false;    ///< its coil is open
};

class Microcontroller {
 public:
  Microcontroller(const McuOptions& options, TimePoint power_on);

  /// The tip touches or leaves at t, which may lie ahead or slightly behind; edges are processed in
  /// the order of their times, and the stamp is that of t in any case.
  void edge(TimePoint t, bool closed);
  /// The host begins to send these bytes at t (or when the wire is free).
  void receive(std::span<const std::uint8_t> bytes, TimePoint t);
  /// The same as a datagram from there.
  void receive(std::span<const std::uint8_t> bytes, TimePoint t, const host_address& from);
  /// Lives until t.
  void advance(TimePoint t);
  /// When it next does something by itself; call advance() then.
  TimePoint next_event() const;

  struct Output {
    TimePoint t{};  ///< when the last bit is on the wire
    drivers::ctp::WireBytes frame;
    host_address to{};  ///< datagrams alone
  };
  /// The next frame that was complete on the wire by the last advance().
  std::optional<Output> next_output();

  /// The output for a controller's input: reported at once as it is, and at each change from then on.
  /// The board drops it with the edge, not in its program's next turn: within 11 us, taken as none.
  using OnOutput = std::function<void(TimePoint t, bool free)>;
  void on_output(OnOutput callback);

  void set_faults(const McuFaults& faults, TimePoint t);
  McuFaults faults() const { return {circuit_, silent_, relay_welded_, relay_dead_}; }
  /// Its clock runs so much faster than nominal from t on, without a jump.
  void set_drift(double ppm, TimePoint t);
  /// Restarts at t: new boot id, clock from zero, no configuration, not armed.
  void reset(TimePoint t, std::uint8_t cause = CTP_RESET_PIN);

  // What a test may look at.
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
  void look_at_circuit(TimePoint t);
  void tell_edge(TimePoint t);
  void move_gun(TimePoint t);
  void drive_relay(TimePoint t);
  void move_relay(TimePoint t);
  void follow_test();
  void follow_output(TimePoint t);
  Duration byte_time() const;

  McuOptions options_;
  TimePoint now_, clock_from_;  ///< of the clock: boot, or its last change of speed
  std::uint32_t first_ticks_, boot_id_;
  std::uint64_t repeats_ = 0;  ///< before the last reset
  sensor sensor_{};
  host_link link_{};
  bool silent_ = false;
  bool relay_welded_ = false, relay_dead_ = false, relay_pulled_ = false;
  TimePoint relay_at_ = TimePoint::max();  ///< its armature is under way until then

  OnOutput on_output_;
  bool free_ = false;  ///< as the output was reported last

  TouchCircuit circuit_;
  CircuitVoltages volts_;
  std::optional<double> gun_v_;  ///< of its capacitor, where it has one
  bool gun_moves_ = false;
  TimePoint gun_at_{};
  bool pin_high_ = true;
  bool seen_high_ = true;  ///< that was reported to the core last
  /// The converter runs for ever; what it would say again and again is not worth the time.
  int conversions_left_ = 0;
  TimePoint next_conversion_{};
  sensor_test last_test_ = TEST_NONE;
  bool last_armed_ = false;

  std::multimap<TimePoint, bool> edges_;  ///< equal times keep the order they came in
  std::deque<Arrival> arrivals_;
  std::deque<Datagram> datagrams_;
  TimePoint rx_free_, tx_free_;
  std::deque<Output> output_;
};

}  // namespace cellcal::sim
