#pragma once
// Residuals of touches under the calibration that was in use when they were made: 'as found'.

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

struct FoundResiduals {
  ResidualSummary fit, check;
};

/// Residuals under `earlier` of touches of spheres that are not outliers. Places and effective
/// radius of the spheres are not errors of the arm: both are fitted to the fit touches, the radius
/// within its prior, as for `before` of a calibration (calib/verdict/residuals.h). Touches of other
/// targets are omitted. Empty if a touch belongs to a sphere or tool unknown to `earlier`, or no
/// sphere was touched.
std::optional<FoundResiduals> found_residuals(const Calibration& earlier,
                                              std::span<const Touch> touches,
                                              const std::vector<bool>& outlier);

}  // namespace cellcal::calib
