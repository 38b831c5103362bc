#include "calib/consistency/named_outliers.h"

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
    result[touch] = held.trace() / rows;  // (22)
  }
  return result;
}

}  // namespace

std::optional<std::string> lies_on(const Problem& problem, const Calibration& calibration,
                                   const TouchResidual& residual) {
  constexpr double kOffItsOwnM = 10e-3;
  constexpr double kOnAnotherM = 1e-3;
  if (std::abs(residual.after_m) < kOffItsOwnM) return std::nullopt;
  Eigen::VectorXd x(problem.arm_size());
  for (int i = 0; i < problem.arm_size(); ++i) {
    const ParameterResult& p = calibration.parameters[static_cast<std::size_t>(i)];
    x[i] = p.nominal + p.correction;
  }
  const Eigen::Vector3d tip_m = problem.arm().position(problem.pose(residual.touch), x.data());
  for (const TargetResult& target : calibration.targets) {
    if (target.id == problem.touches()[residual.touch].target) continue;
    double off_m = 0.0;
    switch (target.kind) {
      case TargetKind::kSphere:
      case TargetKind::kPoint:
        off_m = (tip_m - target.centre_m).norm() - target.effective_radius_m;
        break;
      case TargetKind::kPlane:
        off_m = (tip_m - target.centre_m).dot(target.normal) - target.effective_radius_m;
        break;
      case TargetKind::kWire:
      case TargetKind::kTracker:
        continue;  // what was read there is not known
    }
    if (std::abs(off_m) < kOnAnotherM) return target.id;
  }
  return std::nullopt;
}

FitTouches fit_touches_of(const std::string& target, std::span<const Touch> touches,
                          const Calibration& calibration) {
  FitTouches own;
  for (const TouchResidual& r : calibration.residuals) {
    if (touches[r.touch].target != target || touches[r.touch].set != TouchSet::kFit) continue;
    ++own.all;
    own.left_out += r.outlier ? 1 : 0;
  }
  return own;
}

std::vector<Outlier> named_outliers(const Problem& problem, const Estimate& estimate,
                                    const Calibration& calibration) {
  const std::vector<double> leverage = leverages(problem, estimate, calibration.residuals);
  std::vector<Outlier> outliers;
  for (const TouchResidual& r : calibration.residuals) {
    if (!r.outlier || problem.touches()[r.touch].set != TouchSet::kFit) continue;
    const std::string& id = problem.touches()[r.touch].target;
    Outlier outlier{r.touch, r.after_m, leverage[r.touch], OutlierKind::kOffItsTarget, id};
    outlier.target_kind = problem.cell().targets[problem.cell().target_index(id)].kind;
    outlier.sigmas = std::abs(r.whitened);
    if (const auto other = lies_on(problem, calibration, r)) {
      outlier.kind = OutlierKind::kOnAnotherTarget;
      outlier.lies_on = *other;
    } else if (outlier.leverage > kHoldsItself) {
      outlier.kind = OutlierKind::kHoldsItself;
    }
    outliers.push_back(std::move(outlier));
  }
  return outliers;
}

}  // namespace cellcal::calib
