#pragma once
// The estimator's own equations of touches of spheres, at the values of a calibration and near them.

#include <vector>

#include "calib/check/foresight.h"
#include "calib/model/kinematics.h"
#include "calib/problem/problem.h"

namespace cellcal::calib {

class KnownTouches {
 public:
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// Throws IdentifyError of a touch of what is no sphere, or of a sphere that the calibration has no place of.
  KnownTouches(const Calibration& calibration, const std::vector<Touch>& touches);
  KnownTouches(const KnownTouches&) = delete;  // parts refer to each other

  const std::vector<Unknown>& unknowns() const { return problem_.unknowns(); }
  const Problem& problem() const { return problem_; }
  /// By the calibration, SI.
  const Eigen::VectorXd& x() const { return x_; }

  /// How far outside of its surface each tip is [m].
  Eigen::VectorXd off_m(const Eigen::VectorXd& x) const;
  /// Derivatives of that by all unknowns, SI.
  RowMajor rows(const Eigen::VectorXd& x) const;
  /// By the calibration.
  ForeseenContact contact(std::size_t touch) const;

 private:
  std::vector<Touch> touches_;
  Cell cell_;
  ArmModel arm_;
  Problem problem_;
  Eigen::VectorXd x_;
};

}  // namespace cellcal::calib
