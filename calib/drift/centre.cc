#include "calib/drift/centre.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace cellcal::calib {

namespace {

/// What is stated counts as much as so many degrees of freedom.
constexpr double kStated = 30.0;
/// Of three components one in a thousand is beyond; it is no scatter.
constexpr double kMostSquare = 16.3;

using Gain = Eigen::Matrix<double, 3, 6>;

Gain row_of(double warmer) {
  Gain row;
  row << Eigen::Matrix3d::Identity(), warmer * Eigen::Matrix3d::Identity();
  return row;
}

}  // namespace

double Centre::warmer(const CheckSeen& check) const {
  return reference_c_ && check.temperature_c ? *check.temperature_c - *reference_c_ : 0.0;
}

Centre::Innovation Centre::against(const CheckSeen& check) const {
  const Gain h = row_of(warmer(check));
  const Eigen::Vector3d off = check.shift_m - h * state_;
  const Eigen::Matrix3d s = h * covariance_ * h.transpose() + check.covariance_m2;
  return {off, s.llt().matrixL().solve(off)};  // (96), f_s beside
}

void Centre::learn(const CheckSeen& check) {
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

void Scatter::learn(const CheckSeen& before, const CheckSeen& check,
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
