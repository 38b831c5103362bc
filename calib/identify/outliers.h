#pragma once
// The fit touches that were left out, each named with how far it is off, to which side, and how
// much else tells about it.

#include <vector>

#include "calib/identify/calibration.h"
#include "calib/identify/estimate.h"
#include "calib/identify/problem.h"

namespace cellcal::calib {

/// In order of the touches. `residuals`: under the estimate, those left out marked
/// (Calibration::residuals).
std::vector<Outlier> named_outliers(const Problem& problem, const Estimate& estimate,
                                    const std::vector<TouchResidual>& residuals);

}  // namespace cellcal::calib
