#pragma once
// What hangs on the joints of an arm whose robot file states no masses.

#include "calib/model/random.h"
#include "calib/model/robot.h"

namespace cellcal::sim {

/// Gives every link from the second on a mass, in proportion to its length on the average (a KR 5's
/// two arms get some 25 kg each), with its centre anywhere between its joints and a little beside.
/// Leaves a robot alone that states any mass.
void hang_masses(calib::Robot& robot, calib::Random& random);

}  // namespace cellcal::sim
