#include "calib/verdict/leave_one_out.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "calib/estimate/parallel.h"

namespace cellcal::calib {

namespace {

/// J'J, its lower triangle.
Eigen::MatrixXd lower_gram(const Eigen::Ref<const RowMajor>& j) {
  const auto count = static_cast<std::size_t>(j.rows());
  std::vector<Eigen::MatrixXd> sums(parts_of(count), Eigen::MatrixXd::Zero(j.cols(), j.cols()));
  by_parts(count, [&](std::size_t part, std::size_t begin, std::size_t behind) {
    constexpr Eigen::Index kRows = 128;  // stays in the cache
    const auto end = static_cast<Eigen::Index>(behind);
    for (auto first = static_cast<Eigen::Index>(begin); first < end; first += kRows)
      sums[part].selfadjointView<Eigen::Lower>().rankUpdate(
          j.middleRows(first, std::min(kRows, end - first)).transpose());
  });
  for (std::size_t part = 1; part < sums.size(); ++part) sums[0] += sums[part];
  return std::move(sums[0]);
}

}  // namespace

NormalEquations normal_equations_without_lengths(const Problem& problem, const Estimate& e) {
  constexpr double kFlat = 1e-8, kHair = 1.0 + 1e-12, kWider = 2.0;
  const Linearisation& linear = e.posterior.linear;
  const auto touched = linear.jacobian.topRows(linear.length_row);
  NormalEquations all{lower_gram(touched),
                      touched.transpose() * linear.residual.head(linear.length_row)};
  for (int i = 0; i < problem.size(); ++i) {
    const Unknown& unknown = problem.unknowns()[i];
    const double weight = unknown.prior_weight / (i < problem.arm_size() ? kWider : 1.0);
    const double prior = std::max(kFlat, weight * weight);
    all.gradient[i] += prior * (e.u[i] - unknown.prior_mean_u);  // (44)
    all.information(i, i) = kHair * (all.information(i, i) + prior);
  }
  return all;
}

namespace {

/// Leverage below which at most this share of the gate passes into the fit, and less into the tip.
constexpr double kHeldByItself = 0.5;
/// Leverages are means over the levels, and may slightly exceed one.
constexpr double kLeastUnheld = 1e-6;
/// A larger error is a contact too early, or none: the search ends with that failure.
constexpr double kLargestErrorM = 3e-3;
/// Sufficient for a mean.
constexpr Eigen::Index kRowsOfPoses = 3 * 60;

}  // namespace

UncheckedTouch least_checked_touch(const Problem& problem, const Estimate& e,
                                   const Eigen::Ref<const Eigen::MatrixXd>& moves) {
  UncheckedTouch worst;
  const auto some = moves.topRows(std::min(kRowsOfPoses, moves.rows()));
  for (const auto& [touch, row] : e.posterior.linear.touch_row)
    for (int k = row; k < row + problem.place_rows(touch); ++k) {
      if (!(e.posterior.leverage[k] > kHeldByItself)) continue;
      const double free = std::max(1.0 - e.posterior.leverage[k], kLeastUnheld);
      // (99): within the gate |r| / sqrt(free), of which r = free unseen / sigma.
      const double sigma_m = problem.sigma_m(touch),
                   unseen_m = std::min(e.gate / std::sqrt(free) * sigma_m, kLargestErrorM);
      const Eigen::VectorXd response_u = e.posterior.covariance_u.topRows(moves.cols()) *
                                         e.posterior.linear.jacobian.row(k).transpose();
      const Eigen::VectorXd shifts = some * response_u;
      double sum = 0.0;
      for (Eigen::Index i = 0; i < shifts.size(); i += 3) sum += shifts.segment<3>(i).norm();
      const double shift_m = unseen_m / sigma_m * sum / (static_cast<double>(shifts.size()) / 3.0);
      if (shift_m > worst.shift_m) worst = {touch, unseen_m, shift_m};
    }
  return worst;
}

}  // namespace cellcal::calib
