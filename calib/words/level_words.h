#pragma once
// Why a model level was taken.

#include <string>

#include "calib/result/calibration.h"

namespace cellcal::calib {

/// "mean over 24 levels, weighted by evidence. Joint compliance: 0.1 x prior (2 %), ...";
/// empty of methods that know no levels.
std::string reason_words(const Calibration& calibration);
/// The same after the level itself, as files have it.
std::string level_and_reason_words(const Calibration& calibration);

}  // namespace cellcal::calib
