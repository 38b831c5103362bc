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

namespace cellcal::sim {

// The touch circuit of drivers/contact/firmware/schematic.svg as resistors, and one capacitor from the
// gun to earth. Faults are deviating values: each is defined once, here, and its effects appear in
// firmware, emulated sensor and host.

/// Drive of the board's test pin (D7).
enum class TestPin { kReleased, kLow, kHigh, kPullUp };

/// Board-specific values. The loop is fed by the board's own supply, which is the converter's
/// reference.
struct TouchBoard {
  double supply_v = 5.0;
  /// Thresholds of the sense pin; in between it keeps its state.
  double low_v = 1.5, high_v = 3.0;
  double pull_up_ohm = 35e3;  ///< of the test pin
  double surge_ohm = 47.0;    ///< R6
  double test_ohm = 125.0;    ///< R3 and the test pin's own
  bool operator==(const TouchBoard&) const = default;
};
inline constexpr TouchBoard kUno{};  ///< ATmega328P; its pull-up has 20 to 50 kiloohms
/// RP2040; its pull-up has 50 to 80 kiloohms.
inline constexpr TouchBoard kEthernetBoard{3.3, 0.8, 2.0, 65e3, 100.0, 97.0};

/// At the converter's inputs.
struct CircuitVoltages {
  double feed_v = 0.0, sense_v = 0.0, earth_v = 0.0;
};

/// All resistances in ohms, kOpen without a connection.
struct TouchCircuit {
  static constexpr double kOpen = 1e12, kShort = 0.1;

  TouchBoard board = kUno;

  // External state.
  bool touching = false;
  double touch_ohm = 0.5;  ///< tip to sphere: higher with dirt and oxide

  // The wires with their fuses, and the joints at the gun.
  double feed_wire = 5.0, sense_wire = 5.0;
  double feed_lug = 0.1, sense_lug = 0.1;
  double sense_end = 470.0;  ///< R7, at the sense wire's end at the gun
  // The wire to the stands and back: to the first, on to the last (which is touched), and back.
  double earth_out = 5.0, earth_between = 0.1, earth_back = 5.0;
  double earth_end = 470.0;  ///< R10, at the end of the return at the last stand
  // Unintended connections.
  double between_lugs = kOpen;     ///< both unscrewed, and touching
  double feed_to_sense = kOpen;    ///< in the cable
  double earth_to_back = kOpen;    ///< likewise: outgoing wire and return
  double sense_to_supply = kOpen;  ///< on the board
  double gun_to_earth = kOpen;     ///< insulation of the gun
  /// Leakage of the clamps to ground.
  double feed_leak_a = 0.0, sense_leak_a = 0.0;
  // Open joints on the board.
  bool capture_joint_open = false;  ///< D8: keeps its level
  bool test_joint_open = false;     ///< D7
  /// A converter input stuck at this value.
  std::optional<double> feed_reads_v = std::nullopt, sense_reads_v = std::nullopt,
                        earth_reads_v = std::nullopt;

  bool isolated = false;   ///< the relay, or plug X1, is open: all four wires
  double gun_farad = 0.0;  ///< gun to earth: hoses, cables, an additional filter

  TestPin test_pin = TestPin::kReleased;

  /// Without a gun voltage, which its capacitor holds: steady state.
  CircuitVoltages voltages(std::optional<double> gun_v = std::nullopt) const;
  /// Level of the sense pin; `before`: its previous one.
  bool pin_high(bool before, std::optional<double> gun_v = std::nullopt) const;
  double gun_at_rest_v() const;
  /// Voltage of the gun this time after `from_v`.
  double gun_after_v(double from_v, double seconds) const;

  bool operator==(const TouchCircuit&) const = default;
};

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
