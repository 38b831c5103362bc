#pragma once
// A cell with targets of any kind whose truth is known, and touches of it in random reachable
// poses.

#include <cstdint>
#include <vector>

#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "sim/cell/truth.h"

namespace cellcal::sim::constraints {

struct Stage {
  calib::Cell cell;                      ///< with the certified lengths as they really are
  Truth truth;                           ///< of a plane: centre_m lies on it; of a tracker: unused
  std::vector<Eigen::Vector3d> normal;   ///< true, per target; of planes only
  std::vector<Eigen::Isometry3d> frame;  ///< true, per target; of trackers only
};

/// `cell` states the centre of every target but trackers, and the normal of every plane; planes
/// stand a little tilted against it, trackers anywhere. Throws std::runtime_error when the arm
/// does not reach a target.
Stage set_up(const calib::Cell& cell, const TruthOptions& options);

struct TouchOptions {
  int fit = 50, check = 0;     ///< in turn on the targets; the check touches last
  double noise_m = 3e-5;       ///< 1 sigma along the constraint; per component of points, trackers
  double rho_m = 0.0;          ///< the circuit closes this far outside a sphere or plane
  double plane_half_m = 0.15;  ///< planes are touched within this of their centre, along and across
  double wire_least_m = 0.15, wire_most_m = 0.7;
  double cone_rad = 1.0;  ///< the tool is at most this far from the inward normal
  std::uint64_t seed = 1;
};

/// Random touches; a tracker's over the whole workspace, wherever the arm happens to be.
std::vector<calib::Touch> touch(const Stage& stage, const TouchOptions& options);

}  // namespace cellcal::sim::constraints
