#pragma once
// Check touches: how far they are off, of what the calibration predicts for them.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "calib/estimate/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Of targets with fit touches. None without covariance.
std::vector<HeldOut> held_out(const Problem& problem, const Calibration& calibration);

/// Root of the mean square; 0 of none.
double rms_of(std::span<const HeldOut> touches);

/// Check touches that are gross errors and not the calibration's: few, far off, and without them it
/// does as it predicts. Needs parameters and covariance.
std::vector<std::size_t> gross_check_touches(const Problem& problem,
                                             const Calibration& calibration);

/// Held-out touches may be worse than the calibration predicts for them, but not by this much.
inline constexpr double kCheckRatio = 2.0;

// Check touches of targets that no fit touch is of: a check of places that the fit has not seen.
// Nobody knows where such a target stands, so its place is fitted from its check touches alone,
// with the arm held as it was found; what they then leave judges the arm, and what the place took
// up does not count: a row of leverage Hat_ii on the place counts as 1 - Hat_ii of one, and its
// residual as r_i / sqrt(1 - Hat_ii), which is what it would be off were the place known.

/// Fills `calibration.residuals` of such touches; those of targets that cannot be judged are left
/// without numbers (NaN). `x_si`: of `problem`.
UnseenChecks judge_unseen(const Problem& problem, const Eigen::VectorXd& x_si,
                          Calibration& calibration);

// Whether the touches of each target hold its place, and which readings hold the scale of the arm:
// a tracker measures lengths itself, and so does a wire.

struct HeldPlaces {
  std::vector<int> loose;       ///< blocks whose touches do not hold their place
  int trackers = 0, wires = 0;  ///< whose readings hold the scale
  /// The last of these; null: none.
  const Target* rule = nullptr;
};

/// Says of each loose target from where it is to be touched.
HeldPlaces judge_places(const Problem& problem, const Calibration& c,
                        std::vector<Finding>& findings);

}  // namespace cellcal::calib
