#pragma once
// Geometry of the arm required for corrections in space: the TCP of the controller's own, nominal
// arm. Provided by the owner of the adapter.

#include <Eigen/Geometry>
#include <span>

namespace cellcal::drivers {

class ArmGeometry {
 public:
  virtual ~ArmGeometry() = default;
  /// The active TCP of the controller, in the robot's root [m], at six axis angles. Called in the
  /// cycle: it must not allocate, lock or throw.
  virtual Eigen::Isometry3d tcp(std::span<const double> axis_rad) const noexcept = 0;
};

}  // namespace cellcal::drivers
