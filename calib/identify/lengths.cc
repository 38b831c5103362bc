#include "calib/identify/lengths.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "calib/identify/parallel.h"

namespace cellcal::calib {

namespace {

/// J'J, its lower triangle.
Eigen::MatrixXd lower_gram(const RowMajor& j) {
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

std::vector<LengthResult> lengths_by_others(const Problem& problem, const Estimate& e,
                                            double inflation) {
  std::vector<LengthResult> results;
  if (problem.lengths().empty()) return results;
  // At the one level of the problem, not the mean of all: a lone length is held so hard that what
  // levels differ by would pass for what the others say. And with wider tolerances: an arm that
  // exceeds them is told so elsewhere, and makes no length wrong.
  constexpr double kFlat = 1e-8, kHair = 1.0 + 1e-12, kWider = 2.0;
  const Linearisation& linear = e.posterior.linear;
  Eigen::MatrixXd information = lower_gram(linear.jacobian);
  Eigen::VectorXd gradient = linear.jacobian.transpose() * linear.residual;
  for (int i = 0; i < problem.size(); ++i) {
    const Unknown& unknown = problem.unknowns()[i];
    const double weight = unknown.prior_weight / (i < problem.arm_size() ? kWider : 1.0);
    const double prior = std::max(kFlat, weight * weight);
    gradient[i] += prior * (e.u[i] - unknown.prior_mean_u);
    information(i, i) = kHair * (information(i, i) + prior);
  }
  const Eigen::LLT<Eigen::MatrixXd> factor(information);
  if (factor.info() != Eigen::Success) return results;
  const Eigen::VectorXd step = -factor.solve(gradient);
  int row = linear.length_row;
  for (const Problem::Length& length : problem.lengths()) {
    const Eigen::VectorXd by = linear.jacobian.row(row).transpose();
    // Whitened: found less certified, in sigmas.
    const double residual = linear.residual[row++] + by.dot(step);
    // With all rows the length has the variance h; without its own, s (Sherman and Morrison).
    const double h = by.dot(factor.solve(by));
    constexpr double kLeast = 1e-9;  // nothing else tells of it: any length would do
    if (!(1.0 - h > kLeast)) continue;
    const double s = h / (1.0 - h);
    LengthResult result;
    result.from = problem.cell().targets[problem.blocks()[length.block_a].target].id;
    result.to = problem.cell().targets[problem.blocks()[length.block_b].target].id;
    result.certified_m = length.length_m;
    result.certified_sigma_m = length.sigma_m;
    result.by_others_m = length.length_m + residual * (1.0 + s) * length.sigma_m;
    result.sigma_m = std::sqrt(inflation * s) * length.sigma_m;
    results.push_back(std::move(result));
  }
  return results;
}

double contradiction(const LengthResult& length) {
  return std::abs(length.by_others_m - length.certified_m) /
         std::hypot(length.sigma_m, length.certified_sigma_m);
}

bool is_contradicted(const LengthResult& length) {
  constexpr double kContradicted = 5.0;
  return contradiction(length) > kContradicted;
}

const LengthResult* worst_contradicted(const std::vector<LengthResult>& lengths) {
  const auto worst = std::max_element(lengths.begin(), lengths.end(),
                                      [](const LengthResult& a, const LengthResult& b) {
                                        return contradiction(a) < contradiction(b);
                                      });
  return worst != lengths.end() && is_contradicted(*worst) ? &*worst : nullptr;
}

}  // namespace cellcal::calib
