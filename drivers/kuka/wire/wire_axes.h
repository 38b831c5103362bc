#pragma once
// Order and units of a robot's axes on KUKA's wires.
//
// Inside: base to flange, so that a linear unit, which carries the arm, is first; radians, of the
// linear unit metres. On the wires: A1 to A6, then E1 on; degrees, of the linear unit millimetres.
// The linear unit is E1. A TCP likewise: metres and radians inside.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/robot.h"
#include "drivers/units.h"

namespace cellcal::drivers {

/// Arm's axes on the wires: A1 to A6.
inline constexpr std::size_t kArmAxes = 6;

/// An axis as the controller names it.
struct WireAxis {
  constexpr WireAxis(std::uint8_t on_wire = 0, bool in_mm = false)
      : place(on_wire), linear(in_mm) {}
  constexpr operator std::uint8_t() const { return place; }
  std::uint8_t place;  ///< 0: A1, 6: E1
  bool linear;         ///< millimetres, not degrees
};

class WireAxes {
 public:
  /// With a linear unit `count` is at least 7.
  constexpr WireAxes(std::size_t count, bool linear_unit) : count_(count), unit_(linear_unit) {}
  explicit WireAxes(std::span<const AxisLimit> limits)
      : WireAxes(limits.size(), !limits.empty() && limits[0].linear) {}

  constexpr std::size_t count() const { return count_; }
  constexpr bool linear(std::size_t axis) const { return unit_ && axis == 0; }
  constexpr std::size_t place(std::size_t axis) const {
    if (!unit_ || axis > kArmAxes) return axis;
    return axis == 0 ? kArmAxes : axis - 1;
  }
  constexpr std::size_t at_place(std::size_t place) const {
    if (!unit_ || place > kArmAxes) return place;
    return place == kArmAxes ? 0 : place + 1;
  }
  constexpr WireAxis name(std::size_t axis) const {
    return {static_cast<std::uint8_t>(place(axis)), linear(axis)};
  }
  /// Degrees, millimetres.
  constexpr double shown(std::size_t axis, double value) const {
    return value * (linear(axis) ? kMmPerM : kDegPerRad);
  }
  /// From degrees, millimetres.
  constexpr double inside(std::size_t axis, double shown) const {
    return linear(axis) ? shown / kMmPerM : shown * kRadPerDeg;
  }
  /// All axes of `on_wire`, which has at least as many.
  AxisAngles inside(const AxisAngles& on_wire) const {
    AxisAngles all;
    for (std::size_t i = 0; i < count_; ++i) all.push_back(inside(i, on_wire[place(i)]));
    return all;
  }

 private:
  std::size_t count_;
  bool unit_;
};

/// From X Y Z [mm], A B C [deg].
inline StatedTcp to_stated_tcp(const std::array<double, 6>& frame) {
  StatedTcp tcp{};
  for (std::size_t i = 0; i < tcp.size(); ++i)
    tcp[i] = i < 3 ? frame[i] / kMmPerM : frame[i] * kRadPerDeg;
  return tcp;
}

}  // namespace cellcal::drivers
