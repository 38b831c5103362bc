#pragma once
// A check as a measurement of the TCP that repeats. What the calibration leaves open is the same in every check by the
// same touches: it stays in the figure as a constant, and its covariance is that of what is another each time.
// Assumption: the tool is what shifted. Failure case: anything else did; it shows as a shift that it would look like.

#include <vector>

#include "calib/check/foresight.h"
#include "calib/check/tcp_check.h"
#include "calib/model/linear.h"

namespace cellcal::calib {

class ShiftGauge {
 public:
  /// `expected`: touches about where all checks will make them. Throws IdentifyError as foresee() does.
  ShiftGauge(const Calibration& calibration, const std::vector<Touch>& expected);

  struct Shift {
    Eigen::Vector3d shift_m;  ///< flange frame
    Eigen::Matrix3d covariance_m2;
    Eigen::VectorXd off_m;  ///< of each touch
  };
  /// One for each that was expected, in their order.
  Shift measure(const std::vector<Touch>& made) const;

  /// What explains that touches came to be off by so much on the mean of some checks and not of others.
  /// `scatter`: variance of that difference by the variance of one check. Likeliest first.
  std::vector<Explanation> causes(const Eigen::VectorXd& off_m, double scatter) const;

  std::size_t touches() const { return foresight_.contacts.size(); }

 private:
  Calibration calibration_;
  Foresight foresight_;
  std::vector<PossibleChange> changes_;
  Cholesky passing_;
};

}  // namespace cellcal::calib
