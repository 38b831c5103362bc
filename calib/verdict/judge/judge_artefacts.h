#pragma once
// What cell and robot file state of artefacts and loads, where the touches contradict it.

#include <vector>

#include "calib/problem/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// The certified length that all else contradicts most; or two certificates that differ.
void judge_lengths(const Calibration& c, std::vector<Finding>& findings);
/// The sphere's diameter, or the wire's zero, that all else contradicts most. Looks at what the
/// findings so far say of its target.
void judge_artefact_biases(const Calibration& c, std::vector<Finding>& findings);
/// Loads that bend the arm the wrong way.
void judge_loads(const Problem& problem, const Calibration& c, std::vector<Finding>& findings);

/// Targets of the cell file without a touch.
void note_untouched(const Problem& problem, std::vector<Finding>& findings);
/// Targets that the touches put far from where the cell file states them.
void note_centres(const Problem& problem, const Calibration& c, std::vector<Finding>& findings);

}  // namespace cellcal::calib
