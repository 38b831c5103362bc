#include "calib/identify/outliers.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>

namespace cellcal::calib {

namespace {

/// From here on a touch is its own witness more than the others are.
constexpr double kHoldsItself = 0.5;

/// How far each touch left out would have held its own place, had it been used: with j its whitened
/// rows and S the covariance without it, j S j' / (1 + j S j'); of three rows the mean over them.
std::vector<double> leverages(const Problem& problem, const Estimate& e,
                              const std::vector<TouchResidual>& residuals) {
  std::vector<double> result(problem.touches().size(), 0.0);
  std::vector<bool> left_out(problem.touches().size(), false);
  bool any = false;
  for (const TouchResidual& r : residuals)
    if (r.outlier) any = left_out[r.touch] = true;
  if (!any) return result;
  const Linearisation outside = linearise(problem, e.u, left_out);
  for (const auto& [touch, row] : outside.touch_row) {
    const int rows = problem.rows(touch);
    const RowMajor j = outside.jacobian.middleRows(row, rows);
    const Eigen::MatrixXd spread = j * e.posterior.covariance_u * j.transpose();
    const Eigen::MatrixXd held =
        (Eigen::MatrixXd::Identity(rows, rows) + spread).partialPivLu().solve(spread);
    result[touch] = held.trace() / rows;
  }
  return result;
}

}  // namespace

std::vector<Outlier> named_outliers(const Problem& problem, const Estimate& estimate,
                                    const std::vector<TouchResidual>& residuals) {
  const std::vector<double> leverage = leverages(problem, estimate, residuals);
  std::vector<Outlier> outliers;
  for (const TouchResidual& r : residuals) {
    if (!r.outlier) continue;
    Outlier outlier{
        r.touch, r.after_m,
        fmt::format("{:+.3f} mm off {}, {:.0f} times the touch noise{}", r.after_m * 1e3,
                    problem.touches()[r.touch].target, std::abs(r.whitened),
                    problem.rows(r.touch) == 3 ? ""  // a distance, to no side
                    : r.after_m > 0            ? " (tip outside: contact seen before the surface)"
                                               : " (tip inside: contact seen too late)"),
        leverage[r.touch]};
    if (outlier.leverage > kHoldsItself)
      outlier.reason += fmt::format(
          "; it would have held its own place at {:.0f} %: hardly anything else tells about it, "
          "touch there again",
          100.0 * outlier.leverage);
    outliers.push_back(std::move(outlier));
  }
  return outliers;
}

}  // namespace cellcal::calib
