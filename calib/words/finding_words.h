#pragma once
// The sentence of each finding, made here and nowhere else: the number first, with its unit and
// uncertainty, then what to do.

#include <string>
#include <vector>

#include "calib/result/finding.h"

namespace cellcal::calib {

/// "certified length S1-S2: 400.000 mm stated, 400.100 +- 0.010 mm measured (7 sigma). Measure ..."
std::string words(const Finding& finding);
/// One for each, in their order.
std::vector<std::string> words(const std::vector<Finding>& findings);
/// Without the opening ("scope: "), for where a heading says it.
std::string sentence(const Finding& finding);

}  // namespace cellcal::calib
