#pragma once
// The fit touches that were left out, each named with how far it is off, to which side, and how
// much else tells about it.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/estimate/estimate.h"
#include "calib/problem/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

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

}  // namespace cellcal::calib
