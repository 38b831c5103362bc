#pragma once
// Information of touches and tolerances on all unknowns, for predicting one statement of the cell
// file by all others (artefacts.h).

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

/// Normal equations of the touches in use, without the certified lengths. At the fullest level
/// instead of the mean over all: a single length is so certain that differences between levels
/// would appear as a contradiction by the others. With wider tolerances: an arm that exceeds them
/// is reported separately and must not affect this test.
NormalEquations normal_equations_without_lengths(const Problem& problem, const Estimate& estimate);

// Redundancy of each touch: the reliability of geodetic networks (Baarda 1968).

/// The touch in use whose largest error within the gate shifts the tip the most, in the mean over
/// the poses of `moves` (aligned_moves(), metres per prior sigma of each arm parameter). Empty if
/// each is determined at least half by the others: then no undetected error has a large effect.
UncheckedTouch least_checked_touch(const Problem& problem, const Estimate& e,
                                   const Eigen::Ref<const Eigen::MatrixXd>& moves);

}  // namespace cellcal::calib
