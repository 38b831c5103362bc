#pragma once
// Where a sphere may be, from lines along which the tip looked for it: a cloud of possible centres.
//
// A search that met it says that the centre is one radius from the tip, and that nothing was met
// before; one that met nothing says that no centre is within a radius of the line. The arm is
// nominal here, and wrong by about kArmSigmaM; distances are believed no better than that.

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "calib/model/random.h"
#include "calib/model/robot.h"

namespace cellcal::calib {

/// Of a nominal tip against another near by, in another posture.
inline constexpr double kArmSigmaM = 0.002;

class CentreParticles {
 public:
  /// From the target's stated centre (1 sigma as stated, 10 mm where none is; cut at three sigma)
  /// or from its box, where all places are as likely. `radius_m`: of sphere and tip together.
  CentreParticles(const Target& target, double radius_m, unsigned seed);

  /// The tip came from `from` and met the sphere at `tip`, base frame [m].
  void hit(const Eigen::Vector3d& from, const Eigen::Vector3d& tip);
  /// It came to `to` and met nothing.
  void miss(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

  /// Of a point from the line between two others.
  static double distance_m(const Eigen::Vector3d& point, const Eigen::Vector3d& from,
                           const Eigen::Vector3d& to);

  /// No place is left that agrees with all lines.
  bool empty() const { return places_.empty(); }
  /// Possible centres, all as likely. Some thousand.
  const std::vector<Eigen::Vector3d>& places() const { return places_; }
  Eigen::Vector3d mean() const;
  Eigen::Matrix3d covariance() const;
  /// Distance of the farthest possible centre.
  double reach_m(const Eigen::Vector3d& from) const;
  const Eigen::Vector3d& prior_mean() const { return prior_mean_; }
  /// From there, of the farthest that any lines could ever leave possible.
  double bound_m() const;
  double prior_sigma_m() const { return prior_sigma_m_; }

 private:
  void draw_again(const std::vector<double>& weight);
  /// Where it was said to be, and on no line that met nothing.
  bool is_possible(const Eigen::Vector3d& place) const;

  double radius_m_;
  Random random_;
  Eigen::Vector3d prior_mean_ = Eigen::Vector3d::Zero();
  double prior_sigma_m_ = 0.0;
  bool has_box_ = false;
  Eigen::Vector3d half_box_m_ = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> places_;
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> missed_;
};

}  // namespace cellcal::calib
