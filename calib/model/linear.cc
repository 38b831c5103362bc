#include "calib/model/linear.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <utility>

#include "calib/model/product.h"

namespace cellcal::calib {

namespace {

/// Up to this size a loop over columns is quickest.
constexpr Eigen::Index kBlock = 24;

/// Inverse of a lower triangle, by halves; the upper triangle of the result is zero beforehand.
void invert(const Eigen::Ref<const Eigen::MatrixXd>& lower, SumOfProducts inverse) {
  const Eigen::Index n = lower.rows(), half = n / 2, rest = n - half;
  if (n > kBlock) {
    invert(lower.topLeftCorner(half, half), inverse.topLeftCorner(half, half));
    invert(lower.bottomRightCorner(rest, rest), inverse.bottomRightCorner(rest, rest));
    add_product(-1.0, inverse.bottomRightCorner(rest, rest),
                product(lower.bottomLeftCorner(rest, half), inverse.topLeftCorner(half, half)),
                inverse.bottomLeftCorner(rest, half));
    return;
  }
  for (Eigen::Index c = 0; c < n; ++c) {
    auto column = inverse.col(c);
    column[c] = 1.0;
    for (Eigen::Index k = c; k < n; ++k) {
      column[k] /= lower(k, k);
      column.tail(n - k - 1) -= column[k] * lower.col(k).tail(n - k - 1);
    }
  }
}

using Solver = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;

}  // namespace

Cholesky::Cholesky(Eigen::MatrixXd symmetric) : factor_(std::move(symmetric)), positive_(true) {
  const Eigen::Index n = factor_.rows();
  for (Eigen::Index first = 0; first < n && positive_; first += kBlock) {
    const Eigen::Index size = std::min(kBlock, n - first), rest = n - first - size;
    Eigen::Ref<Eigen::MatrixXd> corner = factor_.block(first, first, size, size);
    positive_ =
        Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(corner).info() == Eigen::Success &&
        (corner.diagonal().array() > 0.0).all();  // a pivot that is no number passes Eigen's test
    if (!positive_ || rest == 0) continue;
    auto below = factor_.block(first + size, first, rest, size);
    corner.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(below);
    add_square(-1.0, below, factor_.bottomRightCorner(rest, rest));
  }
}

Eigen::MatrixXd Cholesky::lower() const { return triangle(); }

double Cholesky::log_det() const { return 2.0 * factor_.diagonal().array().log().sum(); }

Eigen::VectorXd Cholesky::solve(const Eigen::VectorXd& b) const { return coloured(whitened(b)); }

Eigen::MatrixXd Cholesky::solve(const Eigen::MatrixXd& b) const {
  if (b.size() == 0) return b;
  return factor_.transpose().triangularView<Eigen::Upper>().solve(whitened(b));
}

Eigen::MatrixXd Cholesky::lower_inverse() const {
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(factor_.rows(), factor_.rows());
  invert(factor_, inverse);
  return inverse;
}

Eigen::MatrixXd Cholesky::inverse() const {
  const Eigen::MatrixXd root = lower_inverse();
  return product(root.transpose(), root);
}

Eigen::VectorXd Cholesky::whitened(const Eigen::VectorXd& b) const {
  if (b.size() == 0) return b;  // Eigen dereferences the first element even of an empty vector
  return triangle().solve(b);
}

Eigen::MatrixXd Cholesky::whitened(const Eigen::MatrixXd& b) const {
  if (b.size() == 0) return b;
  return triangle().solve(b);
}

Eigen::VectorXd Cholesky::coloured(const Eigen::VectorXd& b) const {
  if (b.size() == 0) return b;
  return factor_.transpose().triangularView<Eigen::Upper>().solve(b);
}

Eigen::VectorXd pivoted_solve(const Eigen::MatrixXd& symmetric, const Eigen::VectorXd& b) {
  return symmetric.ldlt().solve(b);
}

Eigenpairs eigenpairs(const Eigen::MatrixXd& symmetric) {
  const Solver solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& symmetric) {
  return Solver(symmetric, Eigen::EigenvaluesOnly).eigenvalues();
}

Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  return a.colPivHouseholderQr().solve(b);
}

Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.colPivHouseholderQr().solve(b);
}

Eigen::VectorXd least_squares(const SixColumns& a, const Eigen::VectorXd& b) {
  return a.colPivHouseholderQr().solve(b);
}

Eigen::Vector4d least_squares(const Eigen::MatrixX4d& a, const Eigen::VectorXd& b) {
  return a.colPivHouseholderQr().solve(b);
}

Eigen::MatrixXd orthonormal(const Eigen::MatrixXd& columns) {
  return Eigen::HouseholderQR<Eigen::MatrixXd>(columns).householderQ() *
         Eigen::MatrixXd::Identity(columns.rows(), columns.cols());
}

Eigen::MatrixXd triangle_of(Eigen::MatrixXd rows) {
  const Eigen::HouseholderQR<Eigen::Ref<Eigen::MatrixXd>> in_place(rows);
  return rows.topRows(rows.cols()).triangularView<Eigen::Upper>();
}

Eigen::MatrixXd without_span(Eigen::MatrixXd a, const Eigen::MatrixXd& columns, double rounding) {
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> turned(columns);
  turned.setThreshold(rounding);
  a.applyOnTheLeft(turned.householderQ().transpose());
  a.applyOnTheRight(turned.householderQ());
  const Eigen::Index rest = a.rows() - turned.rank();
  return a.bottomRightCorner(rest, rest);
}

PointSpread spread_of(const Eigen::MatrixXd& points) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(points, Eigen::ComputeFullU);
  return {svd.singularValues(), svd.matrixU()};
}

Eigen::Isometry3d rigid_motion(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  return Eigen::Isometry3d(Eigen::umeyama(from, to, false));
}

}  // namespace cellcal::calib
