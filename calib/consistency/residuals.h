#pragma once
// What the touches look like under the nominal arm and under the result.

#include "calib/problem/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Of the block's own unknowns, without a sphere's radius: where the nominal arm's tips put it.
Eigen::VectorXd place_seen_by_nominal_arm(const Problem& problem, int block,
                                          const std::vector<bool>& outlier);

/// Fills residuals, before, after, check_before and check of the calibration. `outlier` per touch;
/// outliers are in no summary. Before: the nominal arm with a stiff tool, and all that is not the
/// arm's fault as its fit touches put it: the targets' places and radii, the radius offset, and the
/// tool's tip as far as the cell file leaves it open (xyz_sigma_mm). Check touches
/// of targets without any fit touch are judged apart (unseen.h).
void fill_residuals(const Problem& problem, const Eigen::VectorXd& x_si,
                    const std::vector<bool>& outlier, Calibration& calibration);

}  // namespace cellcal::calib
