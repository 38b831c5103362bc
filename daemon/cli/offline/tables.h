#pragma once
// What a person reads of a result.

#include <span>
#include <string>

#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::daemon {

enum class Detail {
  kSummary,  ///< about ten lines
  kAll       ///< chi^2, noise, observability, correlations, each outlier, what was found besides
};

/// Residuals before and after, predicted accuracy, outliers, and the verdict with what withholds the
/// result or has to be looked at. Ends with a line break. `touches`: those of the calibration, where
/// they are known, so that outliers can be found in their file.
std::string result_words(const calib::Calibration& calibration,
                         std::span<const calib::Touch> touches = {},
                         Detail detail = Detail::kSummary);

}  // namespace cellcal::daemon
