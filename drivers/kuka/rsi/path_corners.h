#pragma once
// Width and speed of each corner of a path, and the braking allowed in it.
//
// In a corner ds/dt = v is constant, unless the arm is brought to rest with at most a deceleration
// A and jerk J of s. With d -> d' the direction's change, M the larger of |d| and |d'|, half length
// e, ramps r of sigma's slope and h = 1 / (1 - r) its level, an axis then has at most
//
//   acceleration |d' - d| h v^2 / 2e + M A
//   jerk         |d' - d| h (v^3 / (4 r e^2) + 1.5 v A / e) + M J
//
// Both increase with v, so that values valid at the corner's speed are valid at any lower speed
// during a brake. The speed reserves at least A = kBrake v^2 / e and J = kBrakeJerk v^3 / e^2. That
// is little at the start of a brake, and more at lower speeds: it proceeds in stages.
//
// Speeds are chosen such that each leg can be travelled between its corners' speeds, at its limits
// and without acceleration at either end.

#include <span>

#include "drivers/kuka/rsi/path_shape.h"

namespace cellcal::drivers {

/// Sets half length, speed and brakes of every corner.
void choose_corners(PathShape& path, std::span<const AxisLimit> limits);
void rest_in_corners(PathShape& path);

}  // namespace cellcal::drivers
