#pragma once
// Elementary turns of the kinematic chain. Internal.

#include <Eigen/Core>
#include <cmath>

#include "calib/model/kinematics.h"

namespace cellcal::calib {

/// R * Rz without building the elementary rotation: mixes columns x and y.
inline void turn_z(Eigen::Matrix3d& r, double c, double s) {
  const Eigen::Vector3d x = r.col(0);
  r.col(0) = c * x + s * r.col(1);
  r.col(1) = c * r.col(1) - s * x;
}

inline void turn_x(Eigen::Matrix3d& r, double c, double s) {
  const Eigen::Vector3d y = r.col(1);
  r.col(1) = c * y + s * r.col(2);
  r.col(2) = c * r.col(2) - s * y;
}

inline void turn_y(Eigen::Matrix3d& r, double c, double s) {
  const Eigen::Vector3d z = r.col(2);
  r.col(2) = c * z + s * r.col(0);
  r.col(0) = c * r.col(0) - s * z;
}

/// Cosine and sine.
struct Direction {
  double c, s;
};
/// Cosine and sine of an error angle, which is usually small: series accurate to 5e-20.
inline Direction direction(double angle) {
  constexpr double kSmall = 0.02;
  if (std::abs(angle) > kSmall) return {std::cos(angle), std::sin(angle)};
  const double q = angle * angle;
  return {1.0 - q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0))),
          angle * (1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0)))};
}

/// Turn of the arm, seen from the table, per turn by the error of a positioner's axis (PreparedPose's
/// factor times its value); zero for a shift.
Eigen::Vector3d turn_by(const ArmChain::Carrier& carrier, AxisError error);

}  // namespace cellcal::calib
