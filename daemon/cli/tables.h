#pragma once
// What a person reads of a result.

#include <string>

#include "calib/identify/calibration.h"

namespace cellcal::daemon {

/// Before, after and check residuals, predicted accuracy, chi^2, observability, what goes together,
/// outliers, and the verdict with its scope and reasons. Ends with a line break.
std::string result_words(const calib::Calibration& calibration);

}  // namespace cellcal::daemon
