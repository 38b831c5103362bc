#include "calib/consistency/unchecked_touch.h"

#include <algorithm>
#include <cmath>

namespace cellcal::calib {

namespace {

/// Below it, of the gate at most that much passes into the fit, and less into the tip.
constexpr double kHeldByItself = 0.5;
/// Leverages come from a mean over the levels, and may be a little more than one.
constexpr double kLeastUnheld = 1e-6;
/// A contact that is farther off than that is met too early, or not at all: the search ends by name.
constexpr double kLargestErrorM = 3e-3;
/// Enough for a mean, where there are more.
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
      const Eigen::VectorXd response_u =
          e.posterior.covariance_u.topRows(moves.cols()) *
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
