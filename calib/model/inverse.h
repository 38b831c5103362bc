#pragma once
// Joint angles for a TCP pose, on nominal geometry, for any arm of six or more joints.

#include <Eigen/Geometry>
#include <optional>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib {

/// Damped Newton from `seed`; the solution nearest to it as a rule. Empty where it does not reach
/// the pose (1e-9 m, 1e-9 rad) inside the joint limits less `margin_rad`.
std::optional<JointVector> inverse(const ArmModel& arm, const Eigen::Isometry3d& tcp,
                                   const JointVector& seed, double margin_rad);

}  // namespace cellcal::calib
