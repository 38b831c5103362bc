#pragma once
// A sphere being searched for: what its touches and the lines without contact leave of its place. All places in
// the base frame [m].

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "calib/plan/centre_particles.h"

namespace cellcal::calib {

/// Error of a nominal arm beyond that in the particles.
inline constexpr double kWrongM = 0.005;

/// Ball that contains the sphere at any possible place: its own radius plus `beyond_m`.
struct Ball {
  Eigen::Vector3d centre_m;
  double beyond_m;
};
/// Without any touch.
Ball ball_of_prior(const CentreParticles& particles);

struct Sought {
  std::size_t target;         ///< index into the cell
  double radius_m;            ///< sum of sphere and tip
  Eigen::Isometry3d carrier;  ///< frame of its stated place
  CentreParticles particles;
  Ball ball = ball_of_prior(particles);
  std::vector<Eigen::Vector3d> tips{};
  std::vector<double> seen_rad{};  ///< angles of the positioner at the last touch
  int lines = 0;
  bool found = false;
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  double sigma_m = 0.0;  ///< the largest

  /// The tip moved from `from` and met it at `tip`. Throws PlanError where so many touches have to be
  /// enough, and are not; `stated` for its words.
  void touched(const Eigen::Vector3d& from, const Eigen::Vector3d& tip, const Target& stated);
  /// Its ball under the current knowledge. Before the first contact it contains the whole initial
  /// region, including excluded places; afterwards it shrinks, barely exceeding the previous one,
  /// whose boundary the arm has just left.
  void shrink_ball();
};

}  // namespace cellcal::calib
