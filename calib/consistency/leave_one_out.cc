#include "calib/consistency/leave_one_out.h"

#include <algorithm>
#include <vector>

#include "calib/problem/parallel.h"

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

}  // namespace cellcal::calib
