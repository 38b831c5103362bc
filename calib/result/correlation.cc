#include "calib/result/correlation.h"

#include <algorithm>
#include <cmath>

#include "calib/linear/cholesky.h"

namespace cellcal::calib {
namespace {

// A parameter whose variance shrinks to this part of itself with the frame held was all frame, such
// as the height of the base: what remains is a trace of the targets' heights, weighted by the ratio
// of the tolerances squared (0.7 mm against 10 mm leave 2e-6), and would correlate with them while
// meaning nothing. A target known to 0.003 mm beside a frame known to 0.7 mm keeps 2e-5.
constexpr double kNothingLeft = 1e-5;

// Correlation matrix conditional on the frame coordinates:
//   S_g = S_1 - F (F' S_1^-1 F)^-1 F',  S_1 the covariance scaled to unit diagonal.
// Returns false where S_1 is not positive definite in double precision.
bool remove_frame(Eigen::MatrixXd& scaled, const Eigen::MatrixXd& basis) {
  const Cholesky factor(scaled);
  if (!factor.positive()) return false;
  const Eigen::MatrixXd whitened = factor.whitened(basis);
  const Cholesky inner(whitened.transpose() * whitened);
  if (!inner.positive()) return false;
  const Eigen::MatrixXd reduced =
      scaled - basis * inner.solve(Eigen::MatrixXd(basis.transpose()));  // (11)
  if (!reduced.allFinite()) return false;
  scaled = reduced;
  return true;
}

}  // namespace

Correlations strong_correlations(const Calibration& calibration, double least) {
  Correlations result;
  const auto count = static_cast<Eigen::Index>(calibration.parameters.size());
  const Eigen::MatrixXd& covariance = calibration.covariance;
  if (count == 0 || covariance.rows() != count || covariance.cols() != count ||
      !covariance.allFinite()) {
    return result;
  }
  result.available = true;

  // Parameters without variance are fixed and correlate with nothing.
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < count; ++i) {
    if (covariance(i, i) > 0.0) free.push_back(i);
  }
  const auto size = static_cast<Eigen::Index>(free.size());
  Eigen::VectorXd scale(size);
  for (Eigen::Index i = 0; i < size; ++i) scale[i] = 1.0 / std::sqrt(covariance(free[i], free[i]));
  Eigen::MatrixXd scaled(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < size; ++j) {
      scaled(i, j) = covariance(free[i], free[j]) * scale[i] * scale[j];
    }
  }
  const Eigen::MatrixXd& basis = calibration.frame_basis;
  if (basis.rows() == count && basis.cols() > 0 && basis.allFinite()) {
    Eigen::MatrixXd scaled_basis(size, basis.cols());
    for (Eigen::Index i = 0; i < size; ++i) scaled_basis.row(i) = basis.row(free[i]) * scale[i];
    result.frame_removed = remove_frame(scaled, scaled_basis);
  }
  std::vector<bool> says_nothing;
  for (const ParameterResult& p : calibration.parameters)
    says_nothing.push_back(p.decided_by == DecidedBy::kFrame || p.key.target >= 0);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = i + 1; j < size; ++j) {
      if (std::min(scaled(i, i), scaled(j, j)) <= kNothingLeft) continue;
      const double correlation = scaled(i, j) / std::sqrt(scaled(i, i) * scaled(j, j));
      if (!std::isfinite(correlation) || std::abs(correlation) < least) continue;
      const auto first = static_cast<std::size_t>(free[i]);
      const auto second = static_cast<std::size_t>(free[j]);
      if (says_nothing[first] || says_nothing[second])
        ++result.of_targets_or_frame;
      else
        result.pairs.push_back({first, second, std::clamp(correlation, -1.0, 1.0)});
    }
  }
  std::stable_sort(result.pairs.begin(), result.pairs.end(),
                   [](const CorrelatedPair& one, const CorrelatedPair& other) {
                     return std::abs(one.correlation) > std::abs(other.correlation);
                   });
  return result;
}

}  // namespace cellcal::calib
