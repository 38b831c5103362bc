#pragma once
// Whether the result is as accurate as was asked for, and more accurate than the nominal arm.

#include <vector>

#include "calib/estimate/problem.h"
#include "calib/result/calibration.h"
#include "calib/verdict/held_out.h"

namespace cellcal::calib {

/// What the calibration foresees of itself where its scope is.
/// Shrinks the scope to the touched places where the prediction holds there and not over the
/// workspace, and states it.
void shrink_scope(const Cell& cell, const Calibration& c, Verdict& verdict);
void judge_predicted(const Cell& cell, const Calibration& c, bool workspace,
                     std::vector<Finding>& findings);

/// What was gained, of a result that may be used.
void note_gain(const Cell& cell, const Calibration& c, bool workspace,
               std::vector<Finding>& findings);
/// What the model does not explain: how much, and what tells it from noise.
void note_model_error(const Problem& problem, const Calibration& c, std::vector<Finding>& findings);

// What holds the scale of the arm, and so for which poses the result may be used; and who would
// notice if it were wrong.

struct Scale {
  std::vector<Problem::Length> lengths;  ///< certified, each once, with ends that the touches hold
  bool by_lengths = false;               ///< they hold it
  bool by_readings = false;              ///< of a tracker or wire
  bool held() const { return by_lengths || by_readings; }
};
Scale scale_of(const Problem& problem, const HeldPlaces& places);

/// The scope and why; what of the scale nothing checks.
void note_scope(const Problem& problem, const Calibration& c, const HeldPlaces& places,
                const Scale& scale, std::vector<Finding>& findings);

// How far the arm, its tool's tip and the effective radius came out from what their files state,
// counted in what the files let them be off: reported, or held against a result.

/// How much longer than drawn the arm is, all lengths together, and what their tolerances alone
/// leave open of that; relative.
struct ArmScale {
  double off = 0.0, sigma = 0.0;
  /// An error of all measures together that would hardly be noticed by the arm.
  double unseen() const;
};
/// `but`: a parameter that is left out.
ArmScale arm_scale(const Problem& problem, const Calibration& c, int but = -1);

/// Errors beyond what the tolerances let one expect: each, and of all lengths together.
void judge_nominal_geometry(const Problem& problem, const Calibration& c,
                            std::vector<Finding>& findings);
/// A tip that meets its targets elsewhere than diameters and tip radius put it.
void judge_radius(const Problem& problem, const Calibration& c, std::vector<Finding>& findings);
/// The same where it is no more than unlikely; they hold nothing back.
void note_tolerances(const Problem& problem, const Calibration& c, std::vector<Finding>& findings);

}  // namespace cellcal::calib
