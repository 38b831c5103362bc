#pragma once
// Check touches: residuals relative to the calibration's prediction for them.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "calib/estimate/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// For targets with fit touches. Empty without covariance.
std::vector<HeldOut> held_out(const Problem& problem, const Calibration& calibration);

/// Root mean square; 0 if empty.
double rms_of(std::span<const HeldOut> touches);

/// Check touches with gross errors of their own: few, far off, and without them the others agree
/// with the prediction. Requires parameters and covariance.
std::vector<std::size_t> gross_check_touches(const Problem& problem,
                                             const Calibration& calibration);

/// Limit of the ratio of held-out residuals to their prediction.
inline constexpr double kCheckRatio = 2.0;

// Check touches of targets without fit touches: a check of places not seen by the fit.
// The place of such a target is unknown and is fitted from its check touches alone, with the arm
// fixed; the remaining residuals test the arm. A row of leverage Hat_ii on the place counts as 1 -
// Hat_ii of one, and its residual as r_i / sqrt(1 - Hat_ii), its value for a known place.

/// Fills `calibration.residuals` of such touches; those of targets that cannot be judged remain
/// NaN. `x_si`: of `problem`.
UnseenChecks judge_unseen(const Problem& problem, const Eigen::VectorXd& x_si,
                          Calibration& calibration);

// Determination of each target's place by its touches, and readings that determine the scale of the
// arm: a tracker measures lengths itself, and so does a wire.

struct HeldPlaces {
  std::vector<int> loose;       ///< blocks whose touches do not determine their place
  int trackers = 0, wires = 0;  ///< number with readings that determine the scale
  /// The last of these; null: none.
  const Target* rule = nullptr;
};

/// Adds a finding for each undetermined target with the directions to touch it from.
HeldPlaces judge_places(const Problem& problem, const Calibration& c, Verdict& verdict);

}  // namespace cellcal::calib
