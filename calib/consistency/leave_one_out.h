#pragma once
// What touches and tolerances say of all unknowns, to be asked what they make of one thing that the
// cell file states (certified_lengths.h, artefact_bias.h).

#include <Eigen/Core>

#include "calib/estimate/estimate.h"
#include "calib/problem/problem.h"

namespace cellcal::calib {

/// Normal equations at an estimate, in prior units.
struct NormalEquations {
  Eigen::MatrixXd information;  ///< lower triangle
  Eigen::VectorXd gradient;     ///< gradient of half the sum of squares
};

/// Of the touches in use, without the certified lengths. At the fullest level, not the mean of all:
/// a lone length is held so hard that what levels differ by would pass for what the others say.
/// And with wider tolerances: an arm that exceeds them is told so elsewhere, and makes nothing else
/// wrong.
NormalEquations normal_equations_without_lengths(const Problem& problem, const Estimate& estimate);

}  // namespace cellcal::calib
