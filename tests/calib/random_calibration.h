#pragma once
// A calibration as from an identification, of an arm with random errors of every kind.

#include "calib/model/linear.h"
#include "calib/result/calibration.h"

namespace cellcal::calib::testing {

/// Every parameter of the level is `scale` times a normal number times its prior sigma, with an
/// uncertainty of a tenth of that. Published, for the workspace.
Calibration random_calibration(const Cell& cell, Random& random, double scale = 1.0,
                               const ModelLevel& level = {});

}  // namespace cellcal::calib::testing
