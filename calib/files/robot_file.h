#pragma once
// The robots that come with cellcal.

#include <string>
#include <vector>

#include "calib/model/robot.h"

namespace cellcal::calib {

/// Of the first of robots_directories() that has any; a file that cannot be read is left out.
std::vector<NamedRobot> shipped_robots();

// Which nominal geometry a robot file states, whatever it says of tolerances, masses, gears, limits and names.

/// SHA-256 of the kinematics: joints in order with their names, signs, offsets, lengths, angles and which errors
/// may be identified; the frames before and behind them. To 1 nm and 1e-9 deg.
std::string nominal_geometry_sha256(const Robot& robot);

}  // namespace cellcal::calib
