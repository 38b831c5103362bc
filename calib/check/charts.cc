#include "calib/check/charts.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace cellcal::calib {

namespace {

constexpr double kLambda = 0.1;  ///< weight of the newest check in the EWMA
/// Allowance subtracted from the CUSUM per check; optimal for steps of 2 sigma.
constexpr double kAllowed = 1.0;

/// Above all limits. Bounds the memory of any shift, however large, to about ten checks.
constexpr double kMost = 8.0;

void keep_below(Eigen::Vector3d& v, double most) {
  if (const double length = v.norm(); length > most) v *= most / length;
}

/// Degrees of freedom by which the stated covariance counts.
constexpr double kStated = 30.0;
/// 99.9 % quantile of chi^2 with three degrees of freedom; larger squares are not scatter.
constexpr double kMostSquare = 16.3;

using Gain = Eigen::Matrix<double, 3, 6>;

Gain row_of(double warmer) {
  Gain row;
  row << Eigen::Matrix3d::Identity(), warmer * Eigen::Matrix3d::Identity();
  return row;
}

}  // namespace

Charts::Statistics Charts::take(const CheckMeasurement& check) {
  Statistics at;
  if (centre_.known()) {
    const Eigen::Vector3d u = centre_.against(check).standard / scatter_.factor();  // (96)
    ewma_ = (1.0 - kLambda) * ewma_ + kLambda * u;                                  // (97)
    forgotten_ *= (1.0 - kLambda) * (1.0 - kLambda);
    const double sigma = std::sqrt(kLambda / (2.0 - kLambda) * (1.0 - forgotten_));
    keep_below(ewma_, kMost * sigma);
    at.ewma = ewma_.norm() / sigma;
    cusum_ += u;  // (98)
    const double length = cusum_.norm();
    cusum_ *= length > kAllowed ? 1.0 - kAllowed / length : 0.0;
    keep_below(cusum_, kMost);
    at.cusum = cusum_.norm();
  }
  if (before_) {
    const auto slope = centre_.per_kelvin_m();
    Eigen::Vector3d by_warmth_m = Eigen::Vector3d::Zero();
    if (slope && check.temperature_c && before_->temperature_c)
      by_warmth_m = (*check.temperature_c - *before_->temperature_c) * *slope;
    scatter_.learn(*before_, check, by_warmth_m);
  }
  before_ = check;
  return at;
}

double Centre::warmer(const CheckMeasurement& check) const {
  return reference_c_ && check.temperature_c ? *check.temperature_c - *reference_c_ : 0.0;
}

Centre::Innovation Centre::against(const CheckMeasurement& check) const {
  const Gain h = row_of(warmer(check));
  const Eigen::Vector3d off = check.shift_m - h * state_;
  const Eigen::Matrix3d s = h * covariance_ * h.transpose() + check.covariance_m2;
  return {off, s.llt().matrixL().solve(off)};  // (96), except f_s
}

void Centre::learn(const CheckMeasurement& check) {
  const double warm = warmer(check);
  if (!known_) {
    known_ = true;
    state_.head<3>() = check.shift_m;
    covariance_.topLeftCorner<3, 3>() = check.covariance_m2;
    if (!reference_c_) return;
    const Eigen::Matrix3d slope = kPerKelvinM * kPerKelvinM * Eigen::Matrix3d::Identity();
    covariance_.bottomRightCorner<3, 3>() = slope;
    covariance_.topLeftCorner<3, 3>() += warm * warm * slope;
    covariance_.topRightCorner<3, 3>() = -warm * slope;
    covariance_.bottomLeftCorner<3, 3>() = -warm * slope;
    return;
  }
  const Gain h = row_of(warm);
  const Eigen::Matrix<double, 6, 3> cross = covariance_ * h.transpose();
  const Eigen::Matrix3d s = h * cross + check.covariance_m2;
  const Eigen::Matrix<double, 6, 3> gain = s.llt().solve(cross.transpose()).transpose();
  state_ += gain * (check.shift_m - h * state_);
  covariance_ -= gain * cross.transpose();
  covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();
}

std::optional<Eigen::Vector3d> Centre::per_kelvin_m() const {
  if (!reference_c_) return std::nullopt;
  return Eigen::Vector3d(state_.tail<3>());
}

void Scatter::learn(const CheckMeasurement& before, const CheckMeasurement& check,
                    const Eigen::Vector3d& by_warmth_m) {
  const Eigen::Matrix3d both = before.covariance_m2 + check.covariance_m2;
  const Eigen::Vector3d apart = check.shift_m - before.shift_m - by_warmth_m;
  const double square = apart.dot(both.llt().solve(apart));
  const double f = factor();
  squares_ += std::min(square, kMostSquare * f * f);
  freedom_ += 3.0;
}

double Scatter::factor() const { return std::sqrt((kStated + squares_) / (kStated + freedom_)); }

}  // namespace cellcal::calib
