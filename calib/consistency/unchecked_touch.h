#pragma once
// How well each touch is checked by the others: the reliability of geodetic networks (Baarda 1968).

#include <Eigen/Core>

#include "calib/estimate/estimate.h"
#include "calib/problem/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// The touch in use whose largest error that stays within the gate shifts the tip the most, in the mean over the poses of
/// `moves` (aligned_moves(), metres per prior sigma of each arm parameter). Nothing where each is held half by
/// the others: then no error that is not seen makes much of a difference.
UncheckedTouch least_checked_touch(const Problem& problem, const Estimate& e,
                                   const Eigen::Ref<const Eigen::MatrixXd>& moves);

}  // namespace cellcal::calib
