#pragma once
// The touch circuit of drivers/contact/firmware/schematic.svg as resistors: what the board's two
// converter inputs and its capture pin see.

namespace cellcal::test {

enum class TestPin { kReleased, kLow, kHigh, kPullUp };

struct TouchCircuit {
  double touch_ohm = 5.0;
  bool touching = false;
  bool feed_wire_broken = false, sense_wire_broken = false;
  TestPin test_pin = TestPin::kReleased;

  static constexpr double kSupplyV = 5.0;
  static constexpr double kFeedOhm = 1e3;       // R1
  static constexpr double kPullDownOhm = 47e3;  // R2
  static constexpr double kTestOhm = 125.0;     // R3 and the pin's own
  static constexpr double kPullUpOhm = 35e3;    // of the pin: 20 to 50 kiloohms
  /// Where the ATmega's input certainly changes, at 5 V; in between it keeps what it was.
  static constexpr double kLowV = 1.5, kHighV = 3.0;

  double sense_v() const {
    Node gun, sense;
    feed(gun);
    touch(gun);
    board(sense);
    return sense_wire_broken ? sense.v() : (gun + sense).v();
  }

  double feed_v() const {
    if (feed_wire_broken) return kSupplyV;
    Node gun, sense;
    feed(gun);
    touch(gun);
    board(sense);
    return sense_wire_broken ? gun.v() : (gun + sense).v();
  }

 private:
  /// A point with all that hangs on it: current into it at 0 V, and conductance.
  struct Node {
    double ampere = 0.0, siemens = 0.0;
    void tie(double volt, double ohm) {
      ampere += volt / ohm;
      siemens += 1.0 / ohm;
    }
    Node operator+(const Node& o) const { return {ampere + o.ampere, siemens + o.siemens}; }
    double v() const { return ampere / siemens; }
  };

  void feed(Node& gun) const {
    constexpr double kAirOhm = 1e12;
    gun.tie(kSupplyV, feed_wire_broken ? kAirOhm : kFeedOhm);
  }
  void touch(Node& gun) const {
    if (touching) gun.tie(0.0, touch_ohm);
  }
  void board(Node& sense) const {
    sense.tie(0.0, kPullDownOhm);
    if (test_pin == TestPin::kLow) sense.tie(0.0, kTestOhm);
    if (test_pin == TestPin::kHigh) sense.tie(kSupplyV, kTestOhm);
    if (test_pin == TestPin::kPullUp) sense.tie(kSupplyV, kPullUpOhm);
  }
};

}  // namespace cellcal::test
