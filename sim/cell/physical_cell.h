#pragma once
// Position of the real tip, and its contacts.

#include <Eigen/Core>
#include <span>

#include "calib/model/linear.h"
#include "calib/model/robot.h"
#include "sim/cell/truth.h"

namespace cellcal::sim {

class PhysicalCell {
 public:
  explicit PhysicalCell(Truth truth) : truth_(std::move(truth)) {}

  /// True TCP [m, true base frame] for the arm's true axis angles [rad]. `warm`: 0 at power on, 1
  /// warmed up (Truth::warm_at).
  Eigen::Vector3d tip_m(std::span<const double> joint_rad, double warm = 0.0) const;
  /// Distance of the tip from the nearest sphere's or plate's surface [m]; the circuit is closed at
  /// <= 0.
  double gap_m(std::span<const double> joint_rad, double warm = 0.0) const;
  /// Depth of the tool's shaft inside a sphere or plate [m], 0 if clear: a crash.
  double shaft_depth_m(std::span<const double> joint_rad, double warm = 0.0) const;
  const Truth& truth() const { return truth_; }

 private:
  Eigen::Vector3d grown_m(const Eigen::Vector3d& flange, double warm) const;

  Truth truth_;
};

// Link masses of an arm whose robot file states none.

/// Gives every link from the second on a mass, on average in proportion to its length (a KR 5's two
/// arms get about 25 kg each), with its centre randomly between its joints and slightly off the
/// line. No effect on a robot with any stated mass.
void assign_masses(calib::Robot& robot, calib::Random& random);

}  // namespace cellcal::sim
