#pragma once
// Millimetres and degrees outside, metres and radians inside.

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>

namespace cellcal::calib {

inline constexpr double kMmPerM = 1000.0;
inline constexpr double kMsPerS = 1000.0;
inline constexpr double kPerMillion = 1e6;
inline constexpr double kRadPerDeg = std::numbers::pi / 180.0;
inline constexpr double kDegPerRad = 180.0 / std::numbers::pi;
inline constexpr double kRadPerTurn = 2.0 * std::numbers::pi;
inline constexpr double kRadPerArcsec = kRadPerDeg / 3600.0;

/// KUKA's frame: xyz [mm] and abc [deg] with R = Rz(A) Ry(B) Rx(C).
struct FrameMmDeg {
  std::array<double, 3> xyz_mm{};
  std::array<double, 3> abc_deg{};
};

Eigen::Isometry3d to_isometry(const FrameMmDeg& frame);
/// At B = +-90 deg A and C are not unique; C = 0 is chosen.
FrameMmDeg to_frame(const Eigen::Isometry3d& isometry);

// Rotation vectors [rad]: rotations and their derivatives.

inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

inline Eigen::Matrix3d turn(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  return angle > 0.0 ? Eigen::AngleAxisd(angle, w / angle).toRotationMatrix()
                     : Eigen::Matrix3d::Identity().eval();
}

/// Inverse of turn; at most half a turn.
inline Eigen::Vector3d turn_vector(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turned(rotation);
  return turned.angle() * turned.axis();
}

/// Left Jacobian of turn(w): derivative of the rotation by w, in the fixed frame.
inline Eigen::Matrix3d turn_derivative(const Eigen::Vector3d& w) {
  const double angle2 = w.squaredNorm(), angle = std::sqrt(angle2);
  const Eigen::Matrix3d k = cross_matrix(w);
  // Below this the next terms of the series are below rounding.
  constexpr double kSmall = 1e-4;
  const double a = angle < kSmall ? 0.5 - angle2 / 24.0 : (1.0 - std::cos(angle)) / angle2;
  const double b =
      angle < kSmall ? 1.0 / 6.0 - angle2 / 120.0 : (angle - std::sin(angle)) / (angle2 * angle);
  return Eigen::Matrix3d::Identity() + a * k + b * k * k;
}

/// Inverse of the left Jacobian; up to half a turn.
inline Eigen::Matrix3d turn_vector_derivative(const Eigen::Vector3d& w) {
  const double angle = w.norm(), half = angle / 2.0;
  const Eigen::Matrix3d k = cross_matrix(w);
  constexpr double kSmall = 1e-4;
  const double b = angle < kSmall ? 1.0 / 12.0 + angle * angle / 720.0
                                  : (1.0 - half / std::tan(half)) / (angle * angle);
  return Eigen::Matrix3d::Identity() - 0.5 * k + b * k * k;
}

}  // namespace cellcal::calib
