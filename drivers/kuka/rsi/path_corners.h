#pragma once
// How wide each corner of a path is, how fast it is passed, and how hard the arm may brake in it.
//
// In a corner ds/dt = v is constant, unless the arm is brought to rest with at most a deceleration
// A and jerk J of s. With d -> d' the direction's change, M the larger of |d| and |d'|, half length
// e, ramps r of sigma's slope and h = 1 / (1 - r) its level, an axis then has at most
//
//   acceleration |d' - d| h v^2 / 2e + M A
//   jerk         |d' - d| h (v^3 / (4 r e^2) + 1.5 v A / e) + M J
//
// Both grow with v, so what holds at the corner's speed holds wherever a brake has made it less.
// The speed leaves room for A = kBrake v^2 / e and J = kBrakeJerk v^3 / e^2 at least. Of that a
// brake has little at first, and more at the lower speeds that it comes to: it goes in stages.
//
// Speeds are such that each leg can be made between its corners' speeds, at its limits and with no
// acceleration at either end.

#include <span>

#include "drivers/kuka/rsi/path_shape.h"

namespace cellcal::drivers {

/// Sets half length, speed and brakes of every corner.
void choose_corners(PathShape& path, std::span<const AxisLimit> limits);
void rest_in_corners(PathShape& path);

}  // namespace cellcal::drivers
