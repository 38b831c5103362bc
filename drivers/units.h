#pragma once
// Radians and metres inside, degrees and millimetres in KUKA's interfaces.

#include <numbers>

namespace cellcal::drivers {

inline constexpr double kDegPerRad = 180.0 / std::numbers::pi;
inline constexpr double kRadPerDeg = std::numbers::pi / 180.0;
inline constexpr double kMmPerM = 1000.0;

}  // namespace cellcal::drivers
