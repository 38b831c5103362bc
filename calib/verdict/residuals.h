#pragma once
// What the touches look like under the nominal arm and under the result.

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

// The fit touches that were left out, each named with how far it is off, to which side, and how
// much else tells about it.

/// The target on whose surface a touch lies instead, where it is centimetres off its own; then it
/// carries the wrong name. Spheres, planes and points are looked at.
std::optional<std::string> lies_on(const Problem& problem, const Calibration& calibration,
                                   const TouchResidual& residual);

/// A target's fit touches.
struct FitTouches {
  int all = 0, left_out = 0;
};
FitTouches fit_touches_of(const std::string& target, std::span<const Touch> touches,
                          const Calibration& calibration);

/// In order of the touches. `calibration`: its residuals, under the estimate and with those left
/// out marked, and its targets.
std::vector<Outlier> named_outliers(const Problem& problem, const Estimate& estimate,
                                    const Calibration& calibration);

// Touches that were not made but copied: a file that was read or pasted twice. Each would count as
// if it had been measured twice, and one that is held out would test the fit against itself.

/// Touches that read the same as others of their target, to the last digit; none where they are
/// few, or where no more than repeats that were rounded to the same digits.
std::optional<Finding> duplicate_touches(std::span<const Touch> touches);

}  // namespace cellcal::calib
