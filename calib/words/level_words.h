#pragma once
// Why a model level was taken.

#include <string>

#include "calib/result/calibration.h"

namespace cellcal::calib {

/// "mean over 24 levels, each by its evidence. Joint compliance: 0.1 of its prior at 2 %, ...";
/// empty of methods that know no levels.
std::string reason_words(const Calibration& calibration);
/// The same behind the level itself, as files have it.
std::string level_and_reason_words(const Calibration& calibration);

}  // namespace cellcal::calib
