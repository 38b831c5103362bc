#pragma once
// Particle filter for the centre of a sphere, from search lines of the tip.
//
// A search with contact places the centre at one radius from the tip, and excludes earlier contact;
// a search without contact excludes centres within a radius of the line. The arm is nominal, and its
// error (arm_sigma_m) limits the accuracy of all distances.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <utility>
#include <vector>

#include "calib/model/linear.h"
#include "calib/model/robot.h"

namespace cellcal::calib {

class CentreParticles {
 public:
  /// Initialised from the target's stated centre (1 sigma as stated, default 10 mm; truncated at
  /// three sigma), or uniformly in its box; wider by `off_m`, 3 sigma. `radius_m`: sum of sphere and tip.
  /// `frame`: that of the target's place, in the base frame.
  CentreParticles(const Target& target, double radius_m, double arm_sigma_m, unsigned seed,
                  const Eigen::Isometry3d& frame = Eigen::Isometry3d::Identity(),
                  double off_m = 0.0);

  /// The tip moved from `from` and met the sphere at `tip`, base frame [m].
  void hit(const Eigen::Vector3d& from, const Eigen::Vector3d& tip);
  /// The tip moved from `from` to `to` without contact.
  void miss(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

  /// Distance of a point from the segment between two others.
  static double distance_m(const Eigen::Vector3d& point, const Eigen::Vector3d& from,
                           const Eigen::Vector3d& to);

  /// True if no place is consistent with all lines.
  bool empty() const { return places_.empty(); }
  /// Equally likely centres, some thousand.
  const std::vector<Eigen::Vector3d>& places() const { return places_; }
  Eigen::Vector3d mean() const;
  Eigen::Matrix3d covariance() const;
  /// Distance of the farthest possible centre.
  double reach_m(const Eigen::Vector3d& from) const;
  const Eigen::Vector3d& prior_mean() const { return prior_mean_; }
  /// Distance of the farthest centre possible under any lines.
  double bound_m() const;
  double prior_sigma_m() const { return prior_sigma_m_; }
  double arm_sigma_m() const { return arm_sigma_m_; }

 private:
  void resample(const std::vector<double>& weight);
  /// True if inside the stated region and not excluded by a line.
  bool is_possible(const Eigen::Vector3d& place) const;

  /// A miss deeper inside the radius than this is impossible.
  double certain_miss_m() const { return 2.0 * arm_sigma_m_; }
  /// Tolerance of the stated region: the nominal arm may see the sphere this far outside.
  double region_tolerance_m() const { return 3.0 * arm_sigma_m_; }

  double radius_m_, arm_sigma_m_;
  Random random_;
  Eigen::Vector3d prior_mean_ = Eigen::Vector3d::Zero();
  double prior_sigma_m_ = 0.0;
  bool has_box_ = false;
  Eigen::Matrix3d box_axes_;  ///< in the base frame
  Eigen::Vector3d half_box_m_ = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> places_;
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> missed_;
};

}  // namespace cellcal::calib
