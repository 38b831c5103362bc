#pragma once
// Naive implementation of the same arm: transforms multiplied out, torques by differences of the
// potential energy. Shares no code with ArmModel; uses only its list of parameters.

#include <Eigen/Geometry>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib::testing {

/// TCP under errors x (empty: none), base frame.
Eigen::Isometry3d naive_tcp(const ArmModel& arm, const JointVector& q, const Eigen::VectorXd& x);

/// Potential energy [J] of links and tool at DH angles `theta` of the nominal geometry.
double potential_j(const Robot& robot, const Tool& tool, const Eigen::VectorXd& theta);

/// Nominal DH angles.
Eigen::VectorXd nominal_theta(const Robot& robot, const JointVector& q);

/// Torque of gravity about each joint in the sense of theta: -dV/d(theta) for a virtual rotation,
/// by central differences.
Eigen::VectorXd torque_by_energy_nm(const Robot& robot, const Tool& tool,
                                    const Eigen::VectorXd& theta);

}  // namespace cellcal::calib::testing
