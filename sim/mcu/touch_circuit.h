#pragma once
// The touch circuit of drivers/contact/firmware/schematic.svg as resistors, at rest. What is wrong
// with it is a resistance that is not as it should be: each fault is written once, here, and
// firmware, emulated sensor and host all see what follows from it.

#include <optional>

namespace cellcal::sim {

/// What the board's test pin (D7) does.
enum class TestPin { kReleased, kLow, kHigh, kPullUp };

/// At the converter's inputs.
struct CircuitVoltages {
  double feed_v = 0.0, sense_v = 0.0, earth_v = 0.0;
};

/// All resistances in ohms, kOpen where nothing connects.
struct TouchCircuit {
  static constexpr double kOpen = 1e12, kShort = 0.1;
  static constexpr double kSupplyV = 5.0;
  /// Where the ATmega's input certainly changes, at 5 V; in between it keeps what it was.
  static constexpr double kLowV = 1.5, kHighV = 3.0;

  // What the world does.
  bool touching = false;
  double touch_ohm = 0.5;  ///< tip to sphere: dirt and oxide are more

  // The wires with their fuses, and the joints at the gun.
  double feed_wire = 5.0, sense_wire = 5.0;
  double feed_lug = 0.1, sense_lug = 0.1;
  double sense_end = 470.0;  ///< R7, in the sense wire's end at the gun
  // The wire to the stands and back: to the first, on to the last (which is touched), and back.
  double earth_out = 5.0, earth_between = 0.1, earth_back = 5.0;
  double earth_end = 470.0;  ///< R10, in the end of the way back at the last stand
  // What should not connect.
  double between_lugs = kOpen;     ///< both unscrewed, and touching
  double feed_to_sense = kOpen;    ///< in the cable
  double earth_to_back = kOpen;    ///< likewise: the way out and the way back
  double sense_to_supply = kOpen;  ///< on the board
  double gun_to_earth = kOpen;     ///< insulation of the gun
  /// What the clamps let through to ground.
  double feed_leak_a = 0.0, sense_leak_a = 0.0;
  // Joints on the board that are open.
  bool capture_joint_open = false;  ///< D8: keeps the level that it had
  bool test_joint_open = false;     ///< D7
  /// A converter input reads this whatever there is.
  std::optional<double> feed_reads_v = std::nullopt, sense_reads_v = std::nullopt,
                        earth_reads_v = std::nullopt;

  TestPin test_pin = TestPin::kReleased;

  CircuitVoltages voltages() const;
  /// D8, which had `before`.
  bool pin_high(bool before) const;

  bool operator==(const TouchCircuit&) const = default;
};

}  // namespace cellcal::sim
