#pragma once
// Whether the touches are what they are taken for: their scatter, copies, outliers, and those that
// were held out.

#include <vector>

#include "calib/problem/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

void judge_scatter(const Problem& problem, const Calibration& c, std::vector<Finding>& findings);
/// Too many left out, of all or of one target.
void judge_outliers(const Problem& problem, const Calibration& c, std::vector<Finding>& findings);
void judge_check_touches(const Problem& problem, const Calibration& c,
                         std::vector<Finding>& findings);

/// What holds nothing back: gross check touches, temperatures, check touches of unseen places, no
/// check touches at all.
void note_touches(const Problem& problem, const Calibration& c, std::vector<Finding>& findings);

}  // namespace cellcal::calib
