#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace cellcal::calib {

/// A = L L' of a symmetric matrix, of which the lower part is read.
class Cholesky {
 public:
  Cholesky() = default;
  explicit Cholesky(const Eigen::MatrixXd& symmetric);

  /// Whether A is positive definite. Nothing else may be asked where it is not.
  bool positive() const { return factor_.info() == Eigen::Success; }

  Eigen::MatrixXd lower() const;  ///< L
  /// L below and on the diagonal, what was there above it.
  const Eigen::MatrixXd& packed() const { return factor_.matrixLLT(); }
  double log_det() const;  ///< of A

  Eigen::VectorXd solve(const Eigen::VectorXd& b) const;  ///< A^-1 b
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const;
  Eigen::MatrixXd inverse() const;                           ///< A^-1
  Eigen::VectorXd whitened(const Eigen::VectorXd& b) const;  ///< L^-1 b
  Eigen::MatrixXd whitened(const Eigen::MatrixXd& b) const;
  Eigen::VectorXd coloured(const Eigen::VectorXd& b) const;  ///< L'^-1 b

 private:
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

/// A^-1 b of a matrix that may be singular, by L D L' with pivots.
Eigen::VectorXd pivoted_solve(const Eigen::MatrixXd& symmetric, const Eigen::VectorXd& b);

/// b' A^-1 b, likewise; 0 where a pivot is negative.
template <int N>
double inverse_square(const Eigen::Matrix<double, N, N>& symmetric,
                      const Eigen::Matrix<double, N, 1>& b) {
  const Eigen::LDLT<Eigen::Matrix<double, N, N>> factor(symmetric);
  return factor.isPositive() ? b.dot(factor.solve(b)) : 0.0;
}

}  // namespace cellcal::calib
