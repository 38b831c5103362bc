#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace cellcal::calib {

/// A = L L' of a symmetric matrix; only the lower triangle is read.
class Cholesky {
 public:
  Cholesky() = default;
  explicit Cholesky(const Eigen::MatrixXd& symmetric);

  /// True if A is positive definite; a precondition of all other members.
  bool positive() const { return factor_.info() == Eigen::Success; }

  Eigen::MatrixXd lower() const;  ///< L
  /// L in the lower triangle including the diagonal; the upper one is unchanged.
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

/// A^-1 b of a possibly singular matrix, by pivoted L D L'.
Eigen::VectorXd pivoted_solve(const Eigen::MatrixXd& symmetric, const Eigen::VectorXd& b);

/// b' A^-1 b, likewise; 0 if a pivot is negative.
template <int N>
double inverse_square(const Eigen::Matrix<double, N, N>& symmetric,
                      const Eigen::Matrix<double, N, 1>& b) {
  const Eigen::LDLT<Eigen::Matrix<double, N, N>> factor(symmetric);
  return factor.isPositive() ? b.dot(factor.solve(b)) : 0.0;
}

struct Eigenpairs {
  Eigen::VectorXd values;   ///< ascending
  Eigen::MatrixXd vectors;  ///< orthonormal, one column per value
};

/// Eigenpairs of a symmetric matrix; only the lower triangle is read.
Eigenpairs eigenpairs(const Eigen::MatrixXd& symmetric);

/// Eigenvalues only; faster than eigenpairs().
Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& symmetric);

using SixColumns = Eigen::Matrix<double, Eigen::Dynamic, 6>;

/// Least-squares solution of A x = b by pivoted QR; 0 along undetermined directions.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
Eigen::VectorXd least_squares(const SixColumns& a, const Eigen::VectorXd& b);
Eigen::Vector4d least_squares(const Eigen::MatrixX4d& a, const Eigen::VectorXd& b);

/// Orthonormal basis of the column span.
Eigen::MatrixXd orthonormal(const Eigen::MatrixXd& columns);

/// R of `rows` = Q R, with as many columns.
Eigen::MatrixXd triangle_of(Eigen::MatrixXd rows);

/// Q' A Q without the span of `columns`, for a symmetric A: Q maps their span to the first axes, which are
/// dropped. Directions smaller than `rounding` relative to the largest are ignored.
Eigen::MatrixXd without_span(Eigen::MatrixXd a, const Eigen::MatrixXd& columns, double rounding);

/// Singular values of a 3 x n matrix in descending order, and their directions in space.
struct PointSpread {
  Eigen::VectorXd values;
  Eigen::MatrixXd directions;
};
PointSpread spread_of(const Eigen::MatrixXd& points);

}  // namespace cellcal::calib
