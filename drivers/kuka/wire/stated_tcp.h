#pragma once
// A TCP as KUKA's controllers write it, in the units of drivers::StatedTcp.

#include <array>

#include "drivers/robot.h"
#include "drivers/units.h"

namespace cellcal::drivers {

/// From X Y Z [mm], A B C [deg].
inline StatedTcp to_stated_tcp(const std::array<double, 6>& frame) {
  StatedTcp tcp{};
  for (std::size_t i = 0; i < tcp.size(); ++i)
    tcp[i] = i < 3 ? frame[i] / kMmPerM : frame[i] * kRadPerDeg;
  return tcp;
}

}  // namespace cellcal::drivers
