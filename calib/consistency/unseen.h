#pragma once
// Check touches of targets that no fit touch is of: a check of places that the fit has not seen.
// Nobody knows where such a target stands, so its place is fitted from its check touches alone,
// with the arm held as it was found; what they then leave judges the arm, and what the place took
// up does not count: a row of leverage Hat_ii on the place counts as 1 - Hat_ii of one, and its
// residual as r_i / sqrt(1 - Hat_ii), which is what it would be off were the place known.

#include "calib/problem/problem.h"

namespace cellcal::calib {

/// Fills `calibration.residuals` of such touches; those of targets that cannot be judged are left
/// without numbers (NaN). `x_si`: of `problem`.
UnseenChecks judge_unseen(const Problem& problem, const Eigen::VectorXd& x_si,
                          Calibration& calibration);

}  // namespace cellcal::calib
