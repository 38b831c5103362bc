#pragma once
// What a person reads of a result.

#include <span>
#include <string>

#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::daemon {

/// Before, after and check residuals, predicted accuracy, chi^2, observability, what goes together,
/// outliers, and the verdict with its scope and reasons. Ends with a line break. `touches`: those
/// of the calibration, where they are known, so that outliers can be found in their file.
std::string result_words(const calib::Calibration& calibration,
                         std::span<const calib::Touch> touches = {});

}  // namespace cellcal::daemon
