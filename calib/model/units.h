#pragma once
// Millimetres and degrees outside, metres and radians inside.

#include <Eigen/Geometry>
#include <array>
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

}  // namespace cellcal::calib
