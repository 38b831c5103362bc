#pragma once
// Joints that were mastered anew, by dial or mark, at the angles that a calibration gives: what is left of their zeros,
// by a few touches.
//
// With r the residuals of the touches against the calibration with these zeros at nominal, V their covariance in an
// unchanged cell (foresight.h) and G their derivatives by the zeros, the errors are (G' V^-1 G)^-1 G' V^-1 r. V
// includes the zeros' own uncertainty, since the joints were mastered by the estimate.
//
// Assumption: nothing but these zeros has changed. Failure case: another change is attributed to them.

#include <cmath>
#include <string>
#include <vector>

#include "calib/check/foresight.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"
#include "calib/words/phrase.h"

namespace cellcal::calib {

/// Remaining error of a zero.
struct MasteredZero {
  std::string joint = {};
  double error_rad = 0.0;  ///< true angle less shown angle, in the controller's sense
  double sigma_rad = 0.0;

  double u_rad() const { return 2.0 * sigma_rad; }  ///< k=2
  /// Within three sigma: the errors of one calibration are common to all checks of it, and a joint that
  /// was mastered well is not to be mastered again.
  bool holds() const { return std::abs(error_rad) <= 3.0 * sigma_rad; }
};

/// "zero of A2 +0.0301 ± 0.0060 deg (k=2) from where it was to be mastered: does not hold. ..."
Phrase phrase(const MasteredZero& zero);

/// The calibration once these joints have been mastered by it: their zeros are nominal. Throws IdentifyError naming a
/// joint that the robot lacks, or that no touch separates from base or tool.
Calibration as_mastered(const Calibration& calibration, const std::vector<std::string>& joints);

/// Derivatives of the touches' residuals by the zeros of these joints [m/rad], one column each.
Eigen::MatrixXd by_zeros(const Calibration& calibration, const std::vector<std::string>& joints,
                         const std::vector<ForeseenContact>& contacts);

/// Remaining errors of these zeros, in their order. `mastered`: of as_mastered(). Throws IdentifyError where the touches
/// do not separate the zeros, and as foresee() does.
std::vector<MasteredZero> zeros_left(const Calibration& mastered,
                                     const std::vector<std::string>& joints,
                                     const std::vector<Touch>& made);

}  // namespace cellcal::calib
