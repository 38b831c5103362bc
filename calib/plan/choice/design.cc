#include "calib/plan/choice/design.h"

#include <algorithm>

#include "calib/linear/eigenpairs.h"

namespace cellcal::calib {

namespace {

/// Of 1 - h: a touch that alone holds something leaves nothing there when it is taken out.
constexpr double kLeast = 1e-12;

}  // namespace

Design::Design(RowMajor rows, Eigen::MatrixXd covariance_u, const Eigen::MatrixXd& moves_m)
    : rows_(std::move(rows)),
      covariance_(std::move(covariance_u)),
      in_(static_cast<std::size_t>(rows_.rows()), false) {
  // Directions that move no tip that matters drop out of L.
  constexpr double kNothing = 1e-12;
  const Eigenpairs weight = eigenpairs(moves_m.transpose() * moves_m);
  const Eigen::VectorXd& values = weight.values;
  Eigen::Index none = 0;
  while (none < values.size() && values[none] <= kNothing * values.tail<1>()[0]) ++none;
  const Eigen::Index kept = values.size() - none;
  const Eigen::MatrixXd root =
      weight.vectors.rightCols(kept) * values.tail(kept).cwiseSqrt().asDiagonal();
  const Eigen::MatrixXd through = covariance_ * rows_.transpose();
  a_ = root.transpose() * through.topRows(moves_m.cols());
  h_ = rows_.cwiseProduct(through.transpose()).rowwise().sum();
  square_ = a_.colwise().squaredNorm();
}

double Design::gain(Eigen::Index candidate) const {
  return square_[candidate] / (1.0 + h_[candidate]);  // (67)
}

double Design::loss(Eigen::Index candidate) const {
  return square_[candidate] / std::max(kLeast, 1.0 - h_[candidate]);
}

Eigen::VectorXd Design::gains_without(Eigen::Index candidate) const {
  // As change() would leave them, from the products alone.
  const double by = 1.0 / std::max(kLeast, 1.0 - h_[candidate]);
  const Eigen::VectorXd with = rows_ * (covariance_ * rows_.row(candidate).transpose());
  const Eigen::VectorXd dot = a_.transpose() * a_.col(candidate);
  const Eigen::ArrayXd step = by * with.array();
  return (square_.array() + 2.0 * step * dot.array() + square_[candidate] * step.square()) /
         (1.0 + h_.array() + step * with.array());
}

void Design::take(Eigen::Index candidate) {
  change(candidate, 1.0);
  in_[static_cast<std::size_t>(candidate)] = true;
}

void Design::drop(Eigen::Index candidate) {
  change(candidate, -1.0);
  in_[static_cast<std::size_t>(candidate)] = false;
}

void Design::change(Eigen::Index candidate, double sign) {
  const Eigen::VectorXd s = covariance_ * rows_.row(candidate).transpose();
  const double by = sign / (1.0 + sign * h_[candidate]);
  const Eigen::VectorXd with = rows_ * s;
  const Eigen::VectorXd a = a_.col(candidate);
  covariance_.noalias() -= (by * s) * s.transpose();  // (68)
  for (Eigen::Index c = 0; c < a_.cols(); ++c) {
    auto own = a_.col(c);
    own -= (by * with[c]) * a;
    square_[c] = own.squaredNorm();
  }
  h_ -= by * with.cwiseAbs2();
}

}  // namespace cellcal::calib
