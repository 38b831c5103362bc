#pragma once
// How far the arm, its tool's tip and the effective radius came out from what their files state,
// counted in what the files let them be off: reported, or held against a result.

#include <vector>

#include "calib/problem/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

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
