#include "calib/verdict/judge/held_out.h"

#include <algorithm>
#include <cmath>

#include "calib/problem/solve.h"

namespace cellcal::calib {

namespace {

/// Of the check touches, too, a few are gross errors: one, or one in so many, where there are
/// enough, further off than so many times what is predicted for them.
constexpr std::size_t kEnoughChecks = 8, kOneGrossOf = 10;
constexpr double kGrossCheck = 4.0;

}  // namespace

std::vector<HeldOut> held_out(const Problem& problem, const Calibration& c) {
  if (c.covariance.rows() != problem.size()) return {};
  Eigen::VectorXd x(problem.size());
  for (int i = 0; i < problem.size(); ++i)
    x[i] = c.parameters[static_cast<std::size_t>(i)].nominal +
           c.parameters[static_cast<std::size_t>(i)].correction;
  const Problem::At at = problem.at(x.data());
  std::vector<HeldOut> all;
  for (std::size_t t = 0; t < problem.touches().size(); ++t) {
    if (problem.touches()[t].set != TouchSet::kCheck || problem.block_of(t) < 0) continue;
    const TargetBlock& block = problem.blocks()[problem.block_of(t)];
    const int rows = problem.rows(t), shared = problem.shared_size();
    Eigen::VectorXd residual(rows);
    RowMajor by_shared(rows, shared), by_target(rows, block.size());
    problem.residual_m(t, at, residual.data(), by_shared.data(), by_target.data());
    RowMajor j = RowMajor::Zero(rows, problem.size());
    j.leftCols(shared) = by_shared;
    j.middleCols(block.first, block.size()) = by_target;
    const Eigen::VectorXd variance = (j * c.covariance).cwiseProduct(j).rowwise().sum().array() +
                                     std::pow(problem.sigma_m(t), 2);
    all.push_back(
        // (58)
        {t, residual.cwiseAbs2().cwiseQuotient(variance).sum(), static_cast<double>(rows)});
  }
  return all;
}

double rms_of(std::span<const HeldOut> touches) {
  double sum = 0.0, rows = 0.0;
  for (const HeldOut& one : touches) {
    sum += one.square;
    rows += one.rows;
  }
  return rows == 0.0 ? 0.0 : std::sqrt(sum / rows);
}

std::vector<std::size_t> gross_check_touches(const Problem& problem, const Calibration& c) {
  std::vector<HeldOut> all = held_out(problem, c);
  if (all.size() < kEnoughChecks) return {};
  std::stable_sort(all.begin(), all.end(), [](const HeldOut& a, const HeldOut& b) {
    return a.square / a.rows > b.square / b.rows;
  });
  const std::size_t most = std::max<std::size_t>(1, all.size() / kOneGrossOf);
  std::size_t aside = 0;
  while (rms_of(std::span(all).subspan(aside)) > kCheckRatio) {
    if (aside == most || all[aside].square < kGrossCheck * kGrossCheck * all[aside].rows) return {};
    ++aside;
  }
  std::vector<std::size_t> touches;
  for (std::size_t k = 0; k < aside; ++k) touches.push_back(all[k].touch);
  return touches;
}

}  // namespace cellcal::calib
