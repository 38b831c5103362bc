#pragma once
// Whether the touches are what they are taken for: their scatter, copies, outliers, and those that
// were held out.

#include <optional>
#include <span>
#include <vector>

#include "calib/estimate/problem.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"
#include "calib/result/finding.h"

namespace cellcal::calib {

void judge_scatter(const Problem& problem, const Calibration& c, std::vector<Finding>& findings);
/// Too many left out, of all or of one target.
void judge_outliers(const Problem& problem, const Calibration& c, std::vector<Finding>& findings);
void judge_check_touches(const Problem& problem, const Calibration& c,
                         std::vector<Finding>& findings);

/// What holds nothing back: gross check touches, temperatures, check touches of unseen places, no
/// check touches at all.
void note_touches(const Problem& problem, const Calibration& c, std::vector<Finding>& findings);

// What cell and robot file state of artefacts and loads, where the touches contradict it.

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

// Temperatures that touches state: the model has none, but whoever reads the result should know
// over which range it was made.

/// The range, and how many touches state one; none where none does.
std::optional<Finding> temperature_finding(std::span<const Touch> touches);

}  // namespace cellcal::calib
