#pragma once
// Remaining error of the zero of a joint that was mastered anew (mastered.h).

#include <cmath>
#include <string>

#include "calib/words/phrase.h"

namespace cellcal::calib {

struct MasteredZero {
  std::string joint = {};
  double error_rad = 0.0;  ///< true angle less shown angle, in the controller's sense
  double sigma_rad = 0.0;

  double u_rad() const { return 2.0 * sigma_rad; }  ///< k=2
  /// Within three sigma: the errors of one calibration are common to all checks of it, and a joint that
  /// was mastered well is not to be mastered again.
  bool holds() const { return std::abs(error_rad) <= 3.0 * sigma_rad; }
};

/// "zero of A2 +0.0301 +- 0.0060 deg (k=2) from where it was to be mastered: does not hold. ..."
Phrase phrase(const MasteredZero& zero);

}  // namespace cellcal::calib
