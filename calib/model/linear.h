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

struct Eigenpairs {
  Eigen::VectorXd values;   ///< rising
  Eigen::MatrixXd vectors;  ///< orthonormal, a column for each value
};

/// Of a symmetric matrix, of which the lower part is read.
Eigenpairs eigenpairs(const Eigen::MatrixXd& symmetric);

/// Alone, and sooner than with the vectors.
Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& symmetric);

using SixColumns = Eigen::Matrix<double, Eigen::Dynamic, 6>;

/// The x that brings A x nearest to b, by QR with pivots; the directions that A does not tell are 0.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
Eigen::VectorXd least_squares(const SixColumns& a, const Eigen::VectorXd& b);
Eigen::Vector4d least_squares(const Eigen::MatrixX4d& a, const Eigen::VectorXd& b);

/// An orthonormal basis of what the columns span.
Eigen::MatrixXd orthonormal(const Eigen::MatrixXd& columns);

/// R of `rows` = Q R, as wide as they are.
Eigen::MatrixXd triangle_of(Eigen::MatrixXd rows);

/// Q' A Q without what `columns` span, of a symmetric A: Q turns their span into the first axes, which are
/// dropped. What of them is smaller than `rounding` beside the largest counts for nothing.
Eigen::MatrixXd without_span(Eigen::MatrixXd a, const Eigen::MatrixXd& columns, double rounding);

/// Of a 3 x n matrix: singular values, the largest first, and their directions in space.
struct PointSpread {
  Eigen::VectorXd values;
  Eigen::MatrixXd directions;
};
PointSpread spread_of(const Eigen::MatrixXd& points);

}  // namespace cellcal::calib
