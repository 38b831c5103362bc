#pragma once
// The rows of least squares: whitened residuals of touches and of certified lengths, and their derivatives
// by the unknowns, (12).

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "calib/problem/problem.h"

namespace cellcal::calib {

/// Owns its work space: evaluating allocates nothing. `problem` must outlive it.
class WhitenedRows {
 public:
  explicit WhitenedRows(const Problem& problem, double sigma_floor_m = 0.0);

  /// Where the following rows are taken; u in prior units.
  void at(const double* u);

  /// Residuals of a touch, and their derivatives: rows of `width`, of which the problem's size is
  /// written; null where not wanted. Returns the number of rows.
  int touch(std::size_t i, double* r, double* j, std::ptrdiff_t width);

  /// The residual of a certified length, and its derivatives; null where not wanted.
  void length(const Problem::Length& length, double* r, double* j) const;

 private:
  const Problem& problem_;
  double floor_m_;
  std::vector<double> x_;
  Eigen::VectorXd scale_;
  std::vector<double> by_shared_;
  Problem::At at_{};
  double by_target_[Problem::kMostRows * TargetBlock::kMost] = {};
};

}  // namespace cellcal::calib
