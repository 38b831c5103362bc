#pragma once
// Link masses of an arm whose robot file states none.

#include "calib/model/random.h"
#include "calib/model/robot.h"

namespace cellcal::sim {

/// Gives every link from the second on a mass, on average in proportion to its length (a KR 5's two
/// arms get about 25 kg each), with its centre randomly between its joints and slightly off the
/// line. No effect on a robot with any stated mass.
void hang_masses(calib::Robot& robot, calib::Random& random);

}  // namespace cellcal::sim
