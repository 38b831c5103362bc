#pragma once
// What the adapter has to know of the arm's geometry where corrections are in space: where the
// controller's own, nominal arm puts its TCP. Whoever puts the adapter together hands it in.

#include <Eigen/Geometry>
#include <span>

namespace cellcal::drivers {

class ArmGeometry {
 public:
  virtual ~ArmGeometry() = default;
  /// The TCP that is active at the controller, in the robot's root [m], at six axis angles. Called
  /// in the cycle: it must not allocate, lock or throw.
  virtual Eigen::Isometry3d tcp(std::span<const double> axis_rad) const noexcept = 0;
};

}  // namespace cellcal::drivers
