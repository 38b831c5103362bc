#pragma once
// What touches look like under the calibration that was in use when they were made: 'as found'.

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

/// Of touches of spheres that are no outlier of theirs, under `earlier`. Where the spheres are and the effective
/// radius are no fault of the arm: both as the fit touches put them best, the radius within its prior, as for
/// `before` of a calibration (calib/verdict/residuals.h). Touches of other targets are left aside. Empty where
/// a touch is of a sphere or tool that `earlier` does not have, or no sphere was touched.
std::optional<FoundResiduals> found_residuals(const Calibration& earlier,
                                              std::span<const Touch> touches,
                                              const std::vector<bool>& outlier);

}  // namespace cellcal::calib
