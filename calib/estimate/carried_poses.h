#pragma once
// Poses of work on a positioner.

#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// A pose described in the frame that the positioner's axes with these angles carry.
struct CarriedPose {
  JointVector joint_rad;
  std::vector<double> carrier_rad;
};

/// Random poses of the nominal tip within 150 mm, per coordinate, of targets that the first `axes`
/// axes carry, in any orientation that the arm reaches, at angles all over the axes' limits. At
/// most `count`; fewer where the arm hardly reaches them, none without such a target. Reproducible.
std::vector<CarriedPose> carried_poses(const ArmModel& arm, const Calibration& calibration,
                                       int axes, int count, unsigned seed);

}  // namespace cellcal::calib
