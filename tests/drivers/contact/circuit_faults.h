#pragma once
// Single faults of the touch circuit, as in the FMEA table of drivers/contact/firmware/README.md.
// Each is applied to the emulated board (fmea_test.cc) and to the simulated one
// (firmware/simavr_fmea_test.cc).

#include <iosfwd>
#include <vector>

#include "drivers/contact.h"
#include "sim/mcu/microcontroller.h"

namespace cellcal::test {

struct CircuitFault {
  const char* name;
  sim::TouchCircuit circuit;
  // Visible at rest, 2 s after its onset; an arming is refused if any of these is set.
  drivers::LoopFlaw flaw = drivers::LoopFlaw::kNone;
  bool in_contact = false;
  bool self_test_fails = false;  ///< at the next arming, which is then refused
  bool undefined = false;        ///< a voltage between the bands: also refused
  // While armed.
  bool trips = false;          ///< spontaneously, at its onset
  bool by_voltage = false;     ///< that trip, or the one of the touch, is not an edge
  bool touch_is_lost = false;  ///< it is armed, but a touch does not trip it

  bool refused() const {
    return flaw != drivers::LoopFlaw::kNone || in_contact || self_test_fails || undefined;
  }
};

inline void PrintTo(const CircuitFault& fault, std::ostream* out) { *out << fault.name; }

/// For a board with another supply: voltages and currents are scaled with it.
inline std::vector<CircuitFault> circuit_faults(const sim::TouchBoard& board = sim::kUno) {
  using drivers::LoopFlaw;
  constexpr double kOpen = sim::TouchCircuit::kOpen, kShort = sim::TouchCircuit::kShort;
  const CircuitFault broken{
      .name = "", .circuit = {}, .flaw = LoopFlaw::kGunBreak, .in_contact = true, .trips = true};
  const CircuitFault unearthed{
      .name = "", .circuit = {}, .flaw = LoopFlaw::kEarthBreak, .trips = true, .by_voltage = true};
  std::vector<CircuitFault> all;
  const auto add = [&all](const char* name, CircuitFault like, auto change) {
    like.name = name;
    change(like.circuit);
    all.push_back(like);
  };
  using C = sim::TouchCircuit&;
  add("None", {}, [](C) {});
  add("FeedWireOpen", broken, [](C c) { c.feed_wire = kOpen; });
  add("SenseWireOpen", broken, [](C c) { c.sense_wire = kOpen; });
  add("FeedLugOff", broken, [](C c) { c.feed_lug = kOpen; });
  add("SenseLugOff", broken, [](C c) { c.sense_lug = kOpen; });
  add("BothLugsOffAndApart", broken, [](C c) { c.feed_lug = c.sense_lug = kOpen; });
  add("BothLugsOffAndTouching", {.name = "", .circuit = {}, .touch_is_lost = true}, [](C c) {
    c.feed_lug = c.sense_lug = kOpen;
    c.between_lugs = kShort;
  });
  add("FeedShortToSense", {.name = "", .circuit = {}, .flaw = LoopFlaw::kGunShort},
      [](C c) { c.feed_to_sense = kShort; });
  add("GunEndResistorMissing", {.name = "", .circuit = {}, .flaw = LoopFlaw::kGunShort},
      [](C c) { c.sense_end = 0.0; });
  add("SenseShortToSupply",
      {.name = "", .circuit = {}, .self_test_fails = true, .by_voltage = true},
      [](C c) { c.sense_to_supply = kShort; });
  add("GunShortToEarth", {.name = "", .circuit = {}, .in_contact = true, .trips = true},
      [](C c) { c.gun_to_earth = kShort; });
  add("GunLeaksToEarth",
      {.name = "", .circuit = {}, .undefined = true, .trips = true, .by_voltage = true},
      [](C c) { c.gun_to_earth = 1000.0; });
  add("OxideOnTheSphere", {.name = "", .circuit = {}, .by_voltage = true},
      [](C c) { c.touch_ohm = 1000.0; });
  add("OxideJustAboveThePin", {.name = "", .circuit = {}, .by_voltage = true},
      [](C c) { c.touch_ohm = 440.0; });
  add("ClampOfTheFeedLeaks",
      {.name = "", .circuit = {}, .undefined = true, .trips = true, .by_voltage = true},
      [](C c) { c.feed_leak_a = 1.6e-3; });
  add("ClampOfTheSenseLeaks",
      {.name = "", .circuit = {}, .undefined = true, .trips = true, .by_voltage = true},
      [](C c) { c.sense_leak_a = 1.0e-3; });
  add("CaptureJointOpen", {.name = "", .circuit = {}, .self_test_fails = true, .by_voltage = true},
      [](C c) { c.capture_joint_open = true; });
  add("TestJointOpen", {.name = "", .circuit = {}, .self_test_fails = true},
      [](C c) { c.test_joint_open = true; });
  add("SenseInputReadsOpen", {.name = "", .circuit = {}, .self_test_fails = true},
      [](C c) { c.sense_reads_v = 4.8; });
  add("FeedInputReadsOpen", {.name = "", .circuit = {}, .flaw = LoopFlaw::kGunBreak},
      [](C c) { c.feed_reads_v = 4.9; });
  add("EarthInputReadsWhole", {}, [](C c) { c.earth_reads_v = 1.6; });
  add("EarthOpenBeforeTheStands", unearthed, [](C c) { c.earth_out = kOpen; });
  add("EarthOpenBetweenTwoStands", unearthed, [](C c) { c.earth_between = kOpen; });
  add("EarthOpenOnTheWayBack", unearthed, [](C c) { c.earth_back = kOpen; });
  add("EarthShortToItsWayBack",
      {.name = "", .circuit = {}, .flaw = LoopFlaw::kEarthShort, .trips = true, .by_voltage = true},
      [](C c) { c.earth_to_back = kShort; });
  add("StandEndResistorMissing",
      {.name = "", .circuit = {}, .flaw = LoopFlaw::kEarthShort, .trips = true, .by_voltage = true},
      [](C c) { c.earth_end = 0.0; });
  for (CircuitFault& fault : all) {
    const double share = board.supply_v / sim::kUno.supply_v;
    sim::TouchCircuit& c = fault.circuit;
    for (auto* reads : {&c.feed_reads_v, &c.sense_reads_v, &c.earth_reads_v})
      if (*reads) **reads *= share;
    c.feed_leak_a *= share;
    c.sense_leak_a *= share;
    c.board = board;
  }
  return all;
}

}  // namespace cellcal::test
