#pragma once
// Robots whose file may have been named instead of the right one.

#include <functional>
#include <vector>

#include "calib/model/robot.h"

namespace cellcal::calib {

/// Asked for where they are needed, for reading them takes a while; empty: there are none to try.
/// The shipped ones are calib/files' (shipped_robots.h).
using OtherRobots = std::function<std::vector<NamedRobot>()>;

}  // namespace cellcal::calib
