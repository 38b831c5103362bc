#pragma once
// What touches and tolerances say of all unknowns, to be asked what they make of one thing that the
// cell file states (certified_lengths.h, artefact_bias.h).

#include <Eigen/Core>

#include "calib/estimate/estimate.h"
#include "calib/estimate/problem.h"
#include "calib/result/calibration.h"

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

// How well each touch is checked by the others: the reliability of geodetic networks (Baarda 1968).

/// The touch in use whose largest error that stays within the gate shifts the tip the most, in the mean over the poses of
/// `moves` (aligned_moves(), metres per prior sigma of each arm parameter). Nothing where each is held half by
/// the others: then no error that is not seen makes much of a difference.
UncheckedTouch least_checked_touch(const Problem& problem, const Estimate& e,
                                   const Eigen::Ref<const Eigen::MatrixXd>& moves);

}  // namespace cellcal::calib
