#pragma once
// A check as a repeatable measurement of the TCP. Errors of the calibration are common to all checks by the same
// touches: they remain in the shift as a constant, and its covariance covers the independent part only. Assumption:
// the tool shifted. Failure case: any other change appears as the tool shift that resembles it.

#include <vector>

#include "calib/check/foresight.h"
#include "calib/check/tcp_check.h"
#include "calib/model/linear.h"

namespace cellcal::calib {

class ShiftGauge {
 public:
  /// `expected`: touches near those of all checks. Throws IdentifyError as foresee() does.
  ShiftGauge(const Calibration& calibration, const std::vector<Touch>& expected);

  struct Shift {
    Eigen::Vector3d shift_m;  ///< flange frame
    Eigen::Matrix3d covariance_m2;
    Eigen::VectorXd off_m;  ///< of each touch
  };
  /// `made`: one touch for each expected one, in the same order.
  Shift measure(const std::vector<Touch>& made) const;

  /// Explanations of a difference `off_m` between the mean residuals of two groups of checks.
  /// `scatter`: variance of that difference over the variance of one check. Most likely first.
  std::vector<Explanation> causes(const Eigen::VectorXd& off_m, double scatter) const;

  std::size_t touches() const { return foresight_.contacts.size(); }

 private:
  Calibration calibration_;
  Foresight foresight_;
  std::vector<PossibleChange> changes_;
  Cholesky passing_;
};

}  // namespace cellcal::calib
