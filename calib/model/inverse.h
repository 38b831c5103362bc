#pragma once
// Joint angles for a TCP pose, on nominal geometry, for any arm of six or more joints.

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib {

/// Damped Newton from `seed`; the solution nearest to it as a rule. Empty where it does not reach
/// the pose (1e-9 m, 1e-9 rad) inside the joint limits less `margin_rad`.
std::optional<JointVector> inverse(const ArmModel& arm, const Eigen::Isometry3d& tcp,
                                   const JointVector& seed, double margin_rad);

// All the ways in which an arm reaches a TCP pose, on nominal geometry.
//
// Where axes 4, 5 and 6 meet in a point and axes 2 and 3 are parallel (every KUKA arm with a
// spherical wrist), in closed form, up to eight: product of exponentials, solved by Paden and
// Kahan's subproblems (Murray, Li, Sastry: A Mathematical Introduction to Robotic Manipulation,
// 3.2), so that no convention of frames comes in. Other arms by Newton from many seeds: most of the
// ways, not surely all.

/// Which of the up to eight: on which side of its singularities the arm is. The signs of the three
/// factors of the Jacobian's determinant, so no two configurations of a pose share them.
struct Posture {
  bool shoulder = false, elbow = false, wrist = false;
  bool operator==(const Posture&) const = default;
};

class Configurations {
 public:
  /// Refers to `arm`. Joint limits less `margin_rad` hold for every solution.
  Configurations(const ArmModel& arm, double margin_rad);

  bool closed_form() const { return wrist_.has_value(); }
  /// Joint angles that reach the pose (1e-9 m, 1e-9 rad), each another configuration. Of angles
  /// that differ by whole turns the one nearest to 0. Empty where it is out of reach.
  std::vector<JointVector> reach(const Eigen::Isometry3d& tcp) const;

  /// Of an arm in closed form.
  Posture posture_of(const JointVector& joint_rad) const;
  /// Of an arm in closed form, whatever the limits: the one in that posture, each angle within half
  /// a turn of 0, as exact as a few roundings leave it. Empty where it is out of reach. Where the
  /// wrist is stretched axis 6 alone turns.
  std::optional<JointVector> in_posture(const Eigen::Isometry3d& tcp, const Posture& posture) const;

 private:
  /// Of the six-axis arm with a spherical wrist, all joint angles 0: unit axes, a point on each,
  /// the point where the last three meet, and the TCP.
  struct Wrist {
    std::array<Eigen::Vector3d, 6> axis, point;
    Eigen::Vector3d centre;
    Eigen::Isometry3d home;
  };
  static std::optional<Wrist> find_wrist(const ArmModel& arm);
  /// Calls finish(six angles) for each that is wanted; null: for all.
  template <typename Finish>
  void by_subproblems(const Eigen::Isometry3d& tcp, const Posture* wanted,
                      const Finish& finish) const;
  std::vector<JointVector> closed(const Eigen::Isometry3d& tcp) const;
  std::vector<JointVector> from_seeds(const Eigen::Isometry3d& tcp) const;

  const ArmModel& arm_;
  double margin_rad_;
  std::optional<Wrist> wrist_;
};

}  // namespace cellcal::calib
