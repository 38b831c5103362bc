#include "calib/drift/trend.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "calib/drift/centre.h"

namespace cellcal::calib {

namespace {

/// Beside the centre and its warmth: the trend's own three.
using Normal = Eigen::Matrix<double, 9, 9>;
using Right = Eigen::Matrix<double, 9, 1>;

/// Time is counted in days here, so that no column is a billion times another.
constexpr double kDayS = 86400.0;
/// Checks of one day have no rate per month.
constexpr double kShortestCreepS = kDayS;

/// Normal equations of centre, warmth and one trend, found = centre + per_K warm + size basis.
struct Fit {
  Normal normal = Normal::Zero();
  Right right = Right::Zero();

  void add(const CheckSeen& check, const Eigen::Matrix3d& weight, double warm, double basis) {
    const double by[3] = {1.0, warm, basis};
    const Eigen::Vector3d weighted = weight * check.shift_m;
    for (int a = 0; a < 3; ++a) {
      right.segment<3>(3 * a) += by[a] * weighted;
      for (int b = 0; b < 3; ++b) normal.block<3, 3>(3 * a, 3 * b) += by[a] * by[b] * weight;
    }
  }
};

struct Best {
  double gain = -1.0;
  std::size_t from = 0;
  DriftShape shape = DriftShape::kStep;
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

double basis_of(DriftShape shape, const std::vector<CheckSeen>& checks, std::size_t from,
                std::size_t k) {
  if (k < from) return 0.0;
  if (shape == DriftShape::kStep) return 1.0;
  return (checks[k].time_s - checks[from - 1].time_s) / kDayS;
}

double sigma_along(const Eigen::Matrix3d& covariance, const Eigen::Vector3d& v) {
  const double length = v.norm();
  const Eigen::Vector3d along =
      length > 0.0 ? Eigen::Vector3d(v / length) : Eigen::Vector3d(Eigen::Vector3d::UnitX());
  return std::sqrt(along.dot(covariance * along));
}

}  // namespace

std::optional<DriftTrend> trend_of(const std::vector<CheckSeen>& checks, double noise,
                                   std::optional<double> reference_c) {
  if (checks.size() < 2) return std::nullopt;
  std::vector<Eigen::Matrix3d> weights;
  std::vector<double> warm;
  Normal fixed = Normal::Zero();
  fixed.block<3, 3>(3, 3) = Eigen::Matrix3d::Identity() / (kPerKelvinM * kPerKelvinM);
  for (const CheckSeen& check : checks) {
    weights.push_back((noise * noise * check.covariance_m2).inverse());
    warm.push_back(reference_c && check.temperature_c ? *check.temperature_c - *reference_c : 0.0);
  }
  // Candidates thin out where there are hundreds: a creep is not known to a check anyway.
  constexpr std::size_t kMostCandidates = 150;
  const std::size_t stride = 1 + checks.size() / kMostCandidates;
  Best best;
  for (std::size_t from = checks.size() - 1; from >= 1; from -= std::min(from, stride)) {
    const bool lasts = checks.back().time_s - checks[from - 1].time_s >= kShortestCreepS;
    for (const DriftShape shape : {DriftShape::kStep, DriftShape::kCreep}) {
      if (shape == DriftShape::kCreep && !lasts) continue;
      Fit fit;
      fit.normal = fixed;
      for (std::size_t k = 0; k < checks.size(); ++k)
        fit.add(checks[k], weights[k], warm[k], basis_of(shape, checks, from, k));
      if (!(fit.normal.diagonal().tail<3>().minCoeff() > 0.0)) continue;  // times out of order
      const Eigen::LDLT<Normal> factor(fit.normal);
      const Right solution = factor.solve(fit.right);
      const double gain = solution.dot(fit.right);
      if (!(gain > best.gain)) continue;
      const Normal inverse = factor.solve(Normal::Identity());
      best = {gain, from, shape, solution.tail<3>(), inverse.bottomRightCorner<3, 3>()};
    }
  }
  if (best.gain < 0.0) return std::nullopt;
  DriftTrend trend;
  trend.shape = best.shape;
  trend.since = checks[best.from].session;
  trend.since_s = checks[best.from].time_s;
  trend.checks = checks.size() - best.from;
  const double now = basis_of(best.shape, checks, best.from, checks.size() - 1);
  trend.now_m = now * best.size;
  trend.now_sigma_m = now * sigma_along(best.covariance, best.size);
  if (best.shape == DriftShape::kCreep) {
    trend.over_s = checks.back().time_s - checks[best.from - 1].time_s;
    trend.rate_m_s = best.size / kDayS;
    trend.rate_sigma_m_s = sigma_along(best.covariance, best.size) / kDayS;
  }
  return trend;
}

}  // namespace cellcal::calib
