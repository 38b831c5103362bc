#pragma once
// Whether a result may be used, and for what.

#include <string_view>

#include "calib/identify/calibration.h"
#include "calib/identify/problem.h"

namespace cellcal::calib {

/// Whether a reason is said of results that may be used, too: no objection.
bool is_note(std::string_view reason);

/// Everything but `verdict` must be filled.
Verdict judge(const Problem& problem, const Calibration& calibration);

}  // namespace cellcal::calib
