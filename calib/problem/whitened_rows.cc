#include "calib/problem/whitened_rows.h"

#include <algorithm>

namespace cellcal::calib {

WhitenedRows::WhitenedRows(const Problem& problem, double sigma_floor_m)
    : problem_(problem),
      floor_m_(sigma_floor_m),
      x_(static_cast<std::size_t>(problem.size())),
      scale_(problem.size()),
      by_shared_(static_cast<std::size_t>(Problem::kMostRows * problem.shared_size())) {
  for (int i = 0; i < problem.size(); ++i) scale_[i] = problem.unknowns()[i].scale;
}

void WhitenedRows::at(const double* u) {
  for (std::size_t i = 0; i < x_.size(); ++i) {
    const Unknown& unknown = problem_.unknowns()[i];
    x_[i] = unknown.origin + unknown.scale * u[i];
  }
  at_ = problem_.at(x_.data());
}

int WhitenedRows::touch(std::size_t i, double* r, double* j, std::ptrdiff_t width) {
  const double weight = 1.0 / std::max(problem_.sigma_m(i), floor_m_);
  const int rows = problem_.rows(i);
  if (j == nullptr) {
    problem_.residual_m(i, at_, r, nullptr, nullptr);
    for (int k = 0; k < rows; ++k) r[k] *= weight;
    return rows;
  }
  const TargetBlock& block = problem_.blocks()[problem_.block_of(i)];
  const int shared = problem_.shared_size(), own = block.size();
  double* by_shared = rows == 1 ? j : by_shared_.data();  // one row goes where it belongs
  problem_.residual_m(i, at_, r, by_shared, by_target_);
  for (int k = 0; k < rows; ++k) {
    r[k] *= weight;
    Eigen::Map<Eigen::VectorXd> to(j + k * width, width);
    to.head(shared) = weight * Eigen::Map<const Eigen::VectorXd>(by_shared + k * shared, shared)
                                   .cwiseProduct(scale_.head(shared));
    to.segment(shared, problem_.size() - shared).setZero();
    to.segment(block.first, own) =
        weight * Eigen::Map<const Eigen::VectorXd>(by_target_ + k * own, own)
                     .cwiseProduct(scale_.segment(block.first, own));
  }
  return rows;
}

void WhitenedRows::length(const Problem::Length& length, double* r, double* j) const {
  const int a = problem_.blocks()[length.block_a].first;
  const int b = problem_.blocks()[length.block_b].first;
  const Eigen::Vector3d between = Eigen::Map<const Eigen::Vector3d>(x_.data() + a) -
                                  Eigen::Map<const Eigen::Vector3d>(x_.data() + b);
  const double distance = between.norm(), sigma_m = std::max(length.sigma_m, floor_m_);
  *r = (distance - length.length_m) / sigma_m;  // (12)
  if (j == nullptr) return;
  const Eigen::Vector3d n =
      distance > 0.0 ? Eigen::Vector3d(between / distance) : Eigen::Vector3d::UnitX();
  for (int k = 0; k < 3; ++k) {
    j[a + k] = n[k] * scale_[a + k] / sigma_m;
    j[b + k] = -n[k] * scale_[b + k] / sigma_m;
  }
}

}  // namespace cellcal::calib
