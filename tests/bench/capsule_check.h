#pragma once
// The check that planning began with, kept to compare speed: whether the arm keeps clear of the
// spheres and their stands. Arm and tool nominal geometry, spheres are spheres, stands are vertical
// posts below them. Not looked at: the arm against itself, and anything that the cell file does not
// name.

#include <Eigen/Core>
#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib {

class CapsuleCheck {
 public:
  /// Targets must state their centres.
  CapsuleCheck(const Cell& cell, const ArmModel& arm);

  /// `tip_margin_m`: how far the tip's end must stay from every sphere's surface.
  bool clear(const JointVector& q, double tip_margin_m) const;
  /// Samples the straight joint-space move finely enough that nothing can pass in between.
  bool clear(const JointVector& from, const JointVector& to, double tip_margin_m) const;

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
