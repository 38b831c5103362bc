#pragma once
// A cell with targets of any kind and known truth, and its touches in random reachable poses.

#include <cstdint>
#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "sim/cell/truth.h"

namespace cellcal::sim::constraints {

struct Stage {
  calib::Cell cell;                      ///< with the true certified lengths
  Truth truth;                           ///< plane: centre_m lies on it; tracker: unused
  std::vector<Eigen::Vector3d> normal;   ///< true, per target; planes only
  std::vector<Eigen::Isometry3d> frame;  ///< true, per target; trackers only
};

/// `cell` states the centre of every target except trackers, and the normal of every plane; planes
/// are slightly tilted, trackers anywhere. Throws std::runtime_error if a target is out of reach.
Stage set_up(const calib::Cell& cell, const TruthOptions& options);

struct TouchOptions {
  int fit = 50, check = 0;     ///< distributed over the targets in turn; check touches last
  double noise_m = 3e-5;       ///< 1 sigma along the constraint; per component for points, trackers
  double rho_m = 0.0;          ///< distance outside a sphere or plane at which the circuit closes
  double plane_half_m = 0.15;  ///< planes are touched within this of their centre, both ways
  double wire_least_m = 0.15, wire_most_m = 0.7;
  double cone_rad = 1.0;  ///< largest angle of the tool to the inward normal
  std::uint64_t seed = 1;
};

/// Random touches; for a tracker over the whole workspace.
std::vector<calib::Touch> touch(const Stage& stage, const TouchOptions& options);

// Random tool orientations at a surface, for simulated touches.

/// TCP orientation (base frame) with the tool's shaft within `cone_rad` of -normal; the roll about
/// it is uniform.
Eigen::Matrix3d random_orientation(const calib::Tool& tool, calib::Random& random,
                                   const Eigen::Vector3d& normal, double cone_rad);

/// Start of the inverse kinematics: the first axis towards `at` (m, base), elbow bent, the rest
/// random inside the limits.
calib::JointVector random_posture(const calib::Robot& robot, calib::Random& random,
                                  const Eigen::Vector3d& at);

// Cells to be compared: the same arm and tool, with a different kind of target in each.

struct Layout {
  std::string name;
  calib::Cell cell;
  bool measures_length = false;  ///< certified distances, wire, tracker; not a sphere's size
};

/// `base`: robot, tool and noise; its targets are replaced.
std::vector<Layout> layouts(const calib::Cell& base);

}  // namespace cellcal::sim::constraints
