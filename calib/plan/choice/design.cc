#include "calib/plan/choice/design.h"

#include <algorithm>

#include "calib/linear/eigenpairs.h"
#include "calib/model/long_work.h"

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
  with_ = rows_ * (covariance_ * rows_.row(candidate).transpose());
  with_of_ = candidate;
  const Eigen::VectorXd& with = with_;
  const Eigen::VectorXd dot = a_.transpose() * a_.col(candidate);
  const Eigen::ArrayXd step = by * with.array();
  return (square_.array() + 2.0 * step * dot.array() + square_[candidate] * step.square()) /
         (1.0 + h_.array() + step * with.array());
}

void Design::take(Eigen::Index candidate) {
  change(candidate, 1.0);
  in_[static_cast<std::size_t>(candidate)] = true;
}

void Design::take_all(const std::vector<std::size_t>& candidates) {
  // First their own rows alone, then all others, few at a time: these stay in the cache.
  constexpr Eigen::Index kTogether = 48;
  const auto count = static_cast<Eigen::Index>(candidates.size());
  RowMajor rows(count, rows_.cols());
  Eigen::MatrixXd a(a_.rows(), count), s(rows_.cols(), count);
  Eigen::VectorXd h(count), by(count);
  for (Eigen::Index t = 0; t < count; ++t) {
    const auto own = static_cast<Eigen::Index>(candidates[static_cast<std::size_t>(t)]);
    rows.row(t) = rows_.row(own);
    a.col(t) = a_.col(own);
    h[t] = h_[own];
    in_[candidates[static_cast<std::size_t>(t)]] = true;
  }
  for (Eigen::Index t = 0; t < count; ++t) {
    poll_cancelled();
    s.col(t) = covariance_ * rows.row(t).transpose();
    by[t] = 1.0 / (1.0 + h[t]);
    const Eigen::Index behind = count - t - 1;
    covariance_.noalias() -= (by[t] * s.col(t)) * s.col(t).transpose();  // (68)
    if (behind == 0) break;
    const Eigen::VectorXd with = rows.bottomRows(behind + 1) * s.col(t);  // its own among them
    for (Eigen::Index c = 1; c <= behind; ++c) a.col(t + c) -= (by[t] * with[c]) * a.col(t);
    h.tail(behind) -= by[t] * with.tail(behind).cwiseAbs2();
  }
  Eigen::Index some = 0;
  for (Eigen::Index first = 0; first < rows_.rows(); first += some) {
    poll_cancelled();
    // Never a single row behind the others: Eigen adds up its product in another order.
    const Eigen::Index left = rows_.rows() - first;
    some = left <= kTogether + 1 ? left : kTogether;
    for (Eigen::Index t = 0; t < count; ++t) {
      const Eigen::VectorXd with = rows_.middleRows(first, some) * s.col(t);
      for (Eigen::Index c = 0; c < some; ++c) a_.col(first + c) -= (by[t] * with[c]) * a.col(t);
      h_.segment(first, some) -= by[t] * with.cwiseAbs2();
    }
    for (Eigen::Index c = first; c < first + some; ++c) square_[c] = a_.col(c).squaredNorm();
  }
  with_of_ = -1;
}

void Design::drop(Eigen::Index candidate) {
  change(candidate, -1.0);
  in_[static_cast<std::size_t>(candidate)] = false;
}

void Design::change(Eigen::Index candidate, double sign) {
  const Eigen::VectorXd s = covariance_ * rows_.row(candidate).transpose();
  const double by = sign / (1.0 + sign * h_[candidate]);
  if (with_of_ != candidate) with_ = rows_ * s;
  with_of_ = -1;
  const Eigen::VectorXd& with = with_;
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
