#pragma once
// Naive implementation of the same arm: transforms multiplied out, torques by differences of the
// potential energy. Shares no code with ArmModel; uses only its list of parameters.

#include <Eigen/Geometry>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib::testing {

/// TCP under errors x (empty: none), base frame.
Eigen::Isometry3d naive_tcp(const ArmModel& arm, const JointVector& q, const Eigen::VectorXd& x);

/// Tilt of one joint's bearing about x (axis 0) or y (1) of the preceding frame.
struct BearingTilt {
  std::size_t joint = 0;
  int axis = 0;
  double angle_rad = 0.0;
};

/// Potential energy [J] of links and tool at DH angles `theta` of the nominal geometry, with one
/// tilted bearing.
double potential_j(const Robot& robot, const Tool& tool, const Eigen::VectorXd& theta,
                   const BearingTilt& tilt = {});

/// Nominal DH angles.
Eigen::VectorXd nominal_theta(const Robot& robot, const JointVector& q);

/// Torque of gravity about each joint in the sense of theta: -dV/d(theta) for a virtual rotation,
/// by central differences.
Eigen::VectorXd torque_by_energy_nm(const Robot& robot, const Tool& tool,
                                    const Eigen::VectorXd& theta);

/// Moment of gravity about the bearing's axis, likewise.
double moment_by_energy_nm(const Robot& robot, const Tool& tool, const Eigen::VectorXd& theta,
                           std::size_t joint, int axis);

}  // namespace cellcal::calib::testing
