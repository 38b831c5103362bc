#pragma once
// Whether the result is as accurate as was asked for, and more accurate than the nominal arm.

#include <vector>

#include "calib/problem/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// What the calibration foresees of itself where its scope is.
void judge_predicted(const Cell& cell, const Calibration& c, bool workspace,
                     std::vector<Finding>& findings);

/// What was gained, of a result that may be used.
void note_gain(const Cell& cell, const Calibration& c, bool workspace,
               std::vector<Finding>& findings);
/// What the model does not explain: how much, and what tells it from noise.
void note_model_error(const Problem& problem, const Calibration& c, std::vector<Finding>& findings);

}  // namespace cellcal::calib
