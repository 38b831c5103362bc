#pragma once
// Findings of the verdict: quality of the touches (scatter, copies, outliers, and held-out ones), and
// accuracy of the result compared with the requirement and with the nominal arm.

#include <optional>
#include <span>
#include <vector>

#include "calib/estimate/problem.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"
#include "calib/verdict/held_out.h"

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

// Accuracy of the result.

/// True if trackers alone measured, the prediction holds between the measured postures, whatever the
/// touches leave undetermined elsewhere, and the cell file states no required_mm.
bool holds_where_measured(const Cell& cell, const Calibration& c);

/// Shrinks the scope to the touched places where the prediction holds there and not over the
/// workspace, the geometry is not `determined`, or a joint was never turned, and states it; not where
/// the cell file states required_mm.
void shrink_scope(const Problem& problem, const Calibration& c, bool determined, Verdict& verdict);
/// Judges the calibration's prediction over its scope.
void judge_predicted(const Cell& cell, const Calibration& c, Verdict& verdict);

/// Adds the improvement, for a result that may be used.
void note_gain(const Cell& cell, const Calibration& c, Verdict& verdict);
/// Adds the model error: its size, and its distinction from noise.
void note_model_error(const Problem& problem, const Calibration& c, Verdict& verdict);

// Data that determine the scale of the arm, and thus the scope of the result; and the data that
// check it.

struct Scale {
  std::vector<Problem::Length> lengths;  ///< certified, each once, with determined ends
  bool by_lengths = false;               ///< they determine it
  bool by_readings = false;              ///< by a tracker or wire
  bool held() const { return by_lengths || by_readings; }
};
Scale scale_of(const Problem& problem, const HeldPlaces& places);

/// Adds the scope with its reason, and the unchecked part of the scale.
void note_scope(const Problem& problem, const Calibration& c, const HeldPlaces& places,
                const Scale& scale, Verdict& verdict);

// Deviation of the arm, its tool's tip and the effective radius from the files' values, in units of
// the files' tolerances: as a note, or as a reason to withhold.

/// Relative error of all lengths of the arm together, and its sigma by their tolerances alone.
struct ArmScale {
  double off = 0.0, sigma = 0.0;
  /// A common error of all measures that the arm would hardly reveal.
  double unseen() const;
};
/// `but`: an omitted parameter.
ArmScale arm_scale(const Problem& problem, const Calibration& c, int but = -1);

/// Errors beyond the tolerances: each, and of all lengths together.
void judge_nominal_geometry(const Problem& problem, const Calibration& c, Verdict& verdict);
/// A tip whose contacts disagree with diameters and tip radius.
void judge_radius(const Problem& problem, const Calibration& c, Verdict& verdict);
/// The same at the level of warnings, which do not withhold.
void note_tolerances(const Problem& problem, const Calibration& c, Verdict& verdict);

}  // namespace cellcal::calib
