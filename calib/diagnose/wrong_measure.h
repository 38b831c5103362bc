#pragma once
// What the cell file states of its artefacts and is not so: a certified length, a diameter, where a
// wire reads zero, where a target stands.

#include <optional>
#include <vector>

#include "calib/estimate/options.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Where a certified length or a size is contradicted: what is wrong. The one of them that all else
/// contradicts most, or another; none where nothing alone mends it.
std::optional<Finding> wrong_measure(const Cell& cell, const std::vector<Touch>& touches,
                                     const IdentifyOptions& options,
                                     const Calibration& calibration);

/// That all makes sense without `wrong`, and what `found`, which is without it, makes of it.
Finding without_length(const CertifiedLength& wrong, const Calibration& found);

}  // namespace cellcal::calib
