#pragma once
// A calibration as an identification would have left it, of an arm with random errors of every kind.

#include "calib/model/random.h"
#include "calib/result/calibration.h"

namespace cellcal::calib::testing {

/// Every parameter of the level at `scale` times a normal number of its prior sigmas; known to a
/// tenth of those. Published, for the workspace.
Calibration random_calibration(const Cell& cell, Random& random, double scale = 1.0,
                               const ModelLevel& level = {});

}  // namespace cellcal::calib::testing
