#pragma once
// Priors of a linear unit whose robot file states none.

#include "calib/model/robot.h"

namespace cellcal::calib {

/// An installed unit of steel rails, rack and pinion; along x.
LinearGuide usual_guide();

}  // namespace cellcal::calib
