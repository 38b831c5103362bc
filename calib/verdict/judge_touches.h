#pragma once
// Quality of the touches: scatter, copies, outliers, and held-out ones.

#include <optional>
#include <span>
#include <vector>

#include "calib/estimate/problem.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"
#include "calib/result/finding.h"

namespace cellcal::calib {

void judge_scatter(const Problem& problem, const Calibration& c, Verdict& verdict);
/// Too many outliers, among all or of one target.
void judge_outliers(const Problem& problem, const Calibration& c, Verdict& verdict);
void judge_check_touches(const Problem& problem, const Calibration& c, Verdict& verdict);

/// Adds findings that do not withhold: gross check touches, temperatures, check touches of unseen
/// places, missing check touches.
void note_touches(const Problem& problem, const Calibration& c, Verdict& verdict);

// Statements of cell and robot file on artefacts and loads, if the touches contradict them.

/// The certified length that all other data contradict most; or two certificates that differ.
void judge_lengths(const Calibration& c, Verdict& verdict);
/// The sphere's diameter, or the wire's zero, that all other data contradict most. Considers
/// earlier findings on its target.
void judge_artefact_biases(const Calibration& c, Verdict& verdict);
/// Loads that bend the arm in the wrong direction.
void judge_loads(const Problem& problem, const Calibration& c, Verdict& verdict);

/// Targets of the cell file without a touch.
void note_untouched(const Problem& problem, Verdict& verdict);
/// Targets whose touches put them far from the cell file's place.
void note_centres(const Problem& problem, const Calibration& c, Verdict& verdict);

// Temperatures stated by touches. The model has none; the range is reported with the result.

/// The range, and the number of touches that state one; empty if there are none.
std::optional<Finding> temperature_finding(std::span<const Touch> touches);

}  // namespace cellcal::calib
