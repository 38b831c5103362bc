#pragma once
// The collision check of the first planner, kept for speed comparison: clearance of the arm from
// the spheres and the vertical posts below them, with nominal geometry of arm and tool. Not
// checked: self-collision, and anything the cell file does not state.

#include <Eigen/Core>
#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib {

class CapsuleCheck {
 public:
  /// Targets must state their centres.
  CapsuleCheck(const Cell& cell, const ArmModel& arm);

  bool clear(const JointVector& q) const;
  /// Samples the straight joint-space move finely enough that no collision is missed.
  bool clear(const JointVector& from, const JointVector& to) const;

 private:
  struct Obstacle {
    Eigen::Vector3d centre_m, foot_m;
    double radius_m;
  };
  const ArmModel& arm_;
  std::vector<Obstacle> obstacles_;
  Eigen::Vector3d up_;
  double floor_m_;
};

}  // namespace cellcal::calib
