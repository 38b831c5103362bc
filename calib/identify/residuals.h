#pragma once
// What the touches look like under the nominal arm and under the result.

#include "calib/identify/calibration.h"
#include "calib/identify/problem.h"

namespace cellcal::calib {

/// Fills residuals, before, after, check_before and check of the calibration. `outlier` per touch;
/// outliers are in no summary. Before: the nominal arm with a stiff tool, and the sphere that fits
/// its fit touches best.
void fill_residuals(const Problem& problem, const Eigen::VectorXd& x_si,
                    const std::vector<bool>& outlier, Calibration& calibration);

}  // namespace cellcal::calib
