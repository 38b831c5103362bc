#pragma once
// Touches under one explanation: the last calibration beforehand, one thing changed by an unknown size.

#include <optional>
#include <vector>

#include "calib/check/change.h"
#include "calib/check/known_touches.h"
#include "calib/linear/cholesky.h"

namespace cellcal::calib {

/// Touches as equations of a calibration's parameters.
class TouchEquations {
 public:
  /// `prior`: as with_drift() has it. Throws IdentifyError as foresee() does.
  TouchEquations(const Calibration& prior, const std::vector<Touch>& touches);

  const std::vector<ForeseenContact>& contacts() const { return contacts_; }
  /// By the prior; behind the calibration's parameters what else the touches ask for.
  const Eigen::VectorXd& x() const { return x_; }
  const Eigen::MatrixXd& covariance() const { return covariance_; }
  /// Of the touches beside all parameters [m^2].
  const Eigen::MatrixXd& noise_m2() const { return noise_m2_; }
  Eigen::Index parameters() const { return parameters_; }
  /// From now on the touch says nothing.
  void set_aside(std::size_t touch);

  Eigen::VectorXd off_m(const Eigen::VectorXd& x) const;
  Eigen::MatrixXd rows(const Eigen::VectorXd& x) const;

 private:
  Eigen::VectorXd in_problem(const Eigen::VectorXd& x) const;

  KnownTouches known_;
  std::vector<Eigen::Index> place_;  ///< of each unknown of the problem; -1: held
  Eigen::Index parameters_;
  std::vector<ForeseenContact> contacts_;
  Eigen::VectorXd x_;
  Eigen::MatrixXd covariance_, noise_m2_;
};

/// One explanation and size: where its parameters come to lie, and how likely the touches are.
struct Explained {
  Eigen::VectorXd x;
  /// Covariance of the parameters beforehand with what the touches are off by.
  Eigen::MatrixXd across_m;
  Cholesky foreseen;      ///< covariance of that [m^2]
  Eigen::VectorXd off_m;  ///< what they are off by, as the last step has it
  Eigen::MatrixXd rows;   ///< at x
  Eigen::VectorXd size;   ///< of the change
  Eigen::MatrixXd size_covariance;
  double log_evidence = 0.0;
  double chi2() const { return foreseen.whitened(off_m).squaredNorm(); }
  /// Of the parameters, with the touches; `beforehand` without them.
  Eigen::MatrixXd covariance(const Eigen::MatrixXd& beforehand) const;
};

/// `moves`: as moved_by(), of all the equations' parameters. `usual`: 1 sigma of each component.
Explained explained(const TouchEquations& touches, const PossibleChange& change,
                    const Eigen::MatrixXd& moves, double usual);

}  // namespace cellcal::calib
