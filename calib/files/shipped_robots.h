#pragma once
// The robots that come with cellcal.

#include <vector>

#include "calib/model/robot.h"

namespace cellcal::calib {

/// Of the first of robots_directories() that has any; a file that cannot be read is left out.
std::vector<NamedRobot> shipped_robots();

}  // namespace cellcal::calib
