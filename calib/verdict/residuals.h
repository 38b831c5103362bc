#pragma once
// Residuals of the touches under the nominal arm and under the result.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/estimate/estimate.h"
#include "calib/estimate/problem.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"
#include "calib/result/finding.h"

namespace cellcal::calib {

ResidualSummary summary_of(std::span<const double> residuals_m);
/// Values of the calibration's first parameters, SI.
Eigen::VectorXd first_values(const Calibration& calibration, Eigen::Index count);

/// The block's own unknowns, without a sphere's radius, fitted to the nominal arm's tips.
Eigen::VectorXd place_seen_by_nominal_arm(const Problem& problem, int block,
                                          const std::vector<bool>& outlier);

/// Fills residuals, before, after, check_before and check of the calibration. `outlier` per touch;
/// outliers are in no summary. Before: the nominal arm with a stiff tool, and the unknowns outside
/// the arm fitted to its fit touches: the targets' places and radii, the radius offset, and the
/// tool's tip if the cell file leaves it open (xyz_sigma_mm). Check touches of targets without any
/// fit touch are judged separately (held_out.h).
void fill_residuals(const Problem& problem, const Eigen::VectorXd& x_si,
                    const std::vector<bool>& outlier, Calibration& calibration);

// Outliers among the fit touches, each with its deviation, its direction, and its redundancy.

/// The target on whose surface a touch lies instead, if it is centimetres off its own; its name is
/// then wrong. Considers spheres, planes and points.
std::optional<std::string> lies_on(const Problem& problem, const Calibration& calibration,
                                   const TouchResidual& residual);

/// Fit touches of a target.
struct FitTouches {
  int all = 0, left_out = 0;
};
FitTouches fit_touches_of(const std::string& target, std::span<const Touch> touches,
                          const Calibration& calibration);

/// In order of the touches. `calibration`: its residuals under the estimate, with outliers marked,
/// and its targets.
std::vector<Outlier> named_outliers(const Problem& problem, const Estimate& estimate,
                                    const Calibration& calibration);

// Touches that are copies: a file read or pasted twice. Each would count as measured twice, and a
// held-out one would test the fit against itself.

/// Touches that equal others of their target to the last digit; empty if they are few, or can be
/// repetitions rounded to the same digits.
std::optional<Finding> duplicate_touches(std::span<const Touch> touches);

}  // namespace cellcal::calib
