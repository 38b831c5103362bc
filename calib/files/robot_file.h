#pragma once
// Robots shipped with cellcal.

#include <string>
#include <vector>

#include "calib/model/robot.h"

namespace cellcal::calib {

/// From the first of robots_directories() that contains any; unreadable files are skipped.
std::vector<NamedRobot> shipped_robots();

// Identifies the nominal geometry of a robot file, independent of tolerances, masses, gears, limits and names.

/// SHA-256 of the kinematics: joints in order with names, signs, offsets, lengths, angles and identifiable
/// errors; the frames before and after them. Rounded to 1 nm and 1e-9 deg.
std::string nominal_geometry_sha256(const Robot& robot);

/// Priors of a linear unit whose robot file states none: an installed unit of steel rails, rack and pinion; along x.
LinearGuide usual_guide();
/// Priors of a positioner set up by its drawing, its rotation points measured by hand.
PositionerAxis usual_positioner_axis();

}  // namespace cellcal::calib
