#pragma once
// The touch circuit of drivers/contact/firmware/schematic.svg as resistors, and one capacitor from the
// gun to earth. Faults are deviating values: each is defined once, here, and its effects appear in
// firmware, emulated sensor and host.

#include <optional>

namespace cellcal::sim {

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

/// The board's supply rail while external current flows into it: a supply cannot sink current, so that any
/// excess over the board's load charges the rail's capacitors, up to the clamp.
struct Rail {
  double supply_v = 5.0, supply_ohm = 0.3;
  double load_a = 0.045;  ///< of the board; 0: hung
  double farad = 120e-6;  ///< of the board's capacitors
  double clamp_v = 1e3,
         clamp_ohm = 1.0;  ///< threshold and slope resistance of Z1; very high: none
  double diode_v = 0.4;    ///< D3

  /// Highest voltage within `seconds` of `from_v` at the sense wire's clamp, through R6 and D3.
  double highest_v(double from_v, double surge_ohm, double seconds) const;
};

}  // namespace cellcal::sim
