#pragma once
// Joint angles for a TCP pose, on nominal geometry, for arms of six or more joints.

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib {

/// Damped Newton's method from `seed`; usually converges to the nearest solution. A linear unit stays
/// where the seed has it. Empty if it does not reach the pose (1e-9 m, 1e-9 rad) inside the joint limits reduced by
/// `margin_rad`, of a linear unit by as many metres, and by a quarter of the range at most.
std::optional<JointVector> inverse(const ArmModel& arm, const Eigen::Isometry3d& tcp,
                                   const JointVector& seed, double margin_rad);

// All configurations of an arm for a TCP pose, on nominal geometry.
//
// If axes 4, 5 and 6 intersect and axes 2 and 3 are parallel (every KUKA arm with a spherical
// wrist), in closed form, up to eight: product of exponentials, solved by the Paden-Kahan
// subproblems (Murray, Li, Sastry: A Mathematical Introduction to Robotic Manipulation, 3.2),
// independent of frame conventions. Other arms by Newton's method from many seeds: most
// configurations, without guarantee of completeness.

/// Identifies one of the up to eight configurations by the side of each singularity that the arm is
/// on: the signs of the three factors of the Jacobian's determinant. No two configurations of a
/// pose share them.
struct Posture {
  bool shoulder = false, elbow = false, wrist = false;
  bool operator==(const Posture&) const = default;
};

class Configurations {
 public:
  /// Refers to `arm`. Every solution respects the joint limits reduced as in inverse().
  Configurations(const ArmModel& arm, double margin_rad);

  bool closed_form() const { return wrist_.has_value(); }
  /// Joint angles that reach the pose (1e-9 m, 1e-9 rad), one entry per configuration. Among angles
  /// that differ by whole turns the one nearest to 0. Empty if out of reach.
  /// `track_m`: position of the linear unit, first in each entry; without one ignored.
  std::vector<JointVector> reach(const Eigen::Isometry3d& tcp, double track_m = 0.0) const;

  /// Requires the closed form.
  Posture posture_of(const JointVector& joint_rad) const;
  /// Requires the closed form; ignores limits. The configuration in that posture, each angle within
  /// half a turn of 0, accurate to rounding. Empty if out of reach. At the wrist singularity only
  /// axis 6 turns.
  std::optional<JointVector> in_posture(const Eigen::Isometry3d& tcp, const Posture& posture,
                                        double track_m = 0.0) const;

 private:
  /// Six-axis arm with a spherical wrist, all joint positions 0: unit axes, a point on each, the wrist
  /// centre, and the TCP.
  struct Wrist {
    std::array<Eigen::Vector3d, 6> axis, point;
    Eigen::Vector3d centre;
    Eigen::Isometry3d home;
  };
  static std::optional<Wrist> find_wrist(const ArmModel& arm);
  /// Calls finish(six angles) for each requested posture; null: for all.
  template <typename Finish>
  void by_subproblems(const Eigen::Isometry3d& tcp, const Posture* wanted,
                      const Finish& finish) const;
  std::vector<JointVector> closed(const Eigen::Isometry3d& tcp, double track_m) const;
  std::vector<JointVector> from_seeds(const Eigen::Isometry3d& tcp, double track_m) const;
  /// As seen from the carriage: with the linear unit at 0.
  Eigen::Isometry3d from_carriage(const Eigen::Isometry3d& tcp, double track_m) const;

  const ArmModel& arm_;
  double margin_rad_;
  std::size_t first_;  ///< of the turning joints
  std::optional<Wrist> wrist_;
};

}  // namespace cellcal::calib
