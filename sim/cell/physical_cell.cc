#include "sim/cell/physical_cell.h"

#include <algorithm>
#include <limits>

namespace cellcal::sim {

namespace {

/// The slim end of a torch may enter between tip and here only as contact; beyond it is the neck.
constexpr double kTipLengthM = 0.06;
constexpr double kNeckRadiusM = 0.012;

double distance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d ab = b - a;
  const double t = std::clamp((p - a).dot(ab) / std::max(ab.squaredNorm(), 1e-18), 0.0, 1.0);
  return (p - a - t * ab).norm();
}

}  // namespace

Eigen::Vector3d PhysicalCell::tip_m(std::span<const double> joint_rad) const {
  return truth_.arm.position(truth_.arm.prepare(joint_rad), truth_.errors.data());
}

double PhysicalCell::gap_m(std::span<const double> joint_rad) const {
  const Eigen::Vector3d tip = tip_m(joint_rad);
  double gap = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < truth_.centre_m.size(); ++i)
    if (truth_.radius_m[i] > 0.0)
      gap = std::min(gap, (tip - truth_.centre_m[i]).norm() - truth_.radius_m[i]);
  return gap;
}

double PhysicalCell::shaft_depth_m(std::span<const double> joint_rad) const {
  const calib::ArmShape shape =
      truth_.arm.shape(truth_.arm.prepare(joint_rad), truth_.errors.data());
  const Eigen::Vector3d tip = shape.tcp.translation(), flange = shape.flange.translation();
  const double length = (flange - tip).norm();
  if (length <= kTipLengthM) return 0.0;
  const Eigen::Vector3d neck = tip + (flange - tip) * (kTipLengthM / length);
  double depth = 0.0;
  for (std::size_t i = 0; i < truth_.centre_m.size(); ++i)
    if (truth_.radius_m[i] > 0.0)
      depth = std::max(
          depth, truth_.radius_m[i] + kNeckRadiusM - distance(truth_.centre_m[i], neck, flange));
  return depth;
}

}  // namespace cellcal::sim
