#include "calib/estimate/information.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/model/linear.h"
#include "calib/model/product.h"

namespace cellcal::calib {

namespace {

/// Upper Cholesky factor of the lower part of `a`, in place, row by row. Rows whose pivot is not
/// positive beyond rounding are zero, so that semi-definite matrices have a factor as well.
Eigen::MatrixXd upper_factor(Eigen::MatrixXd a) {
  constexpr double kRounding = 1e-14;
  const Eigen::Index n = a.rows();
  const Eigen::VectorXd diagonal = a.diagonal();
  for (Eigen::Index k = 0; k < n; ++k) {
    const Eigen::Index below = n - k - 1;
    if (!(a(k, k) > kRounding * diagonal[k])) {
      a.col(k).tail(below + 1).setZero();
      continue;
    }
    a(k, k) = std::sqrt(a(k, k));
    auto column = a.col(k).tail(below);
    column /= a(k, k);
    for (Eigen::Index c = 0; c < below; ++c)
      a.col(k + 1 + c).tail(below - c) -= column[c] * column.tail(below - c);
  }
  return a.triangularView<Eigen::Lower>().transpose();
}

}  // namespace

Information::Information(Eigen::Index unknowns, bool all_digits)
    : all_digits_(all_digits), sum_(Eigen::MatrixXd::Zero(unknowns + 1, unknowns + 1)) {}

void Information::add(const Eigen::Ref<const RowMajor>& rows) {
  if (rows.rows() == 0) return;
  if (!all_digits_) {
    add_square(1.0, rows.transpose(), sum_);
    return;
  }
  const Eigen::Index n = sum_.rows();
  Eigen::MatrixXd stacked(n + rows.rows(), n);
  stacked << sum_, rows;
  sum_ = triangle_of(std::move(stacked));  // (19)
}

void Information::add(const Information& other) {
  if (all_digits_)
    add(RowMajor(other.sum_));
  else
    sum_ += other.sum_;
}

void Information::add_alone(const Eigen::VectorXd& weight, const Eigen::VectorXd& residual) {
  const Eigen::Index n = weight.size();
  if (all_digits_) {
    RowMajor rows = RowMajor::Zero(n, n + 1);
    rows.leftCols(n).diagonal() = weight;
    rows.col(n) = residual;
    add(rows);
    return;
  }
  sum_.diagonal().head(n) += weight.cwiseAbs2();
  sum_.row(n).head(n) += weight.cwiseProduct(residual).transpose();
  sum_(n, n) += residual.squaredNorm();
}

Eigen::MatrixXd Information::triangle() const {
  if (all_digits_) return sum_;
  const Cholesky factor(sum_);  // (19)
  if (!factor.positive()) return upper_factor(sum_);
  return factor.lower().transpose();
}

}  // namespace cellcal::calib
