#pragma once
// The same arm the slow and obvious way: transforms multiplied out, torques from the potential
// energy by differences. Shares no code with ArmModel; takes only its list of parameters.

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

/// Torque of gravity about each joint in the sense of theta: what a virtual turn d(theta) gains,
/// -dV/d(theta), by central differences.
Eigen::VectorXd torque_by_energy_nm(const Robot& robot, const Tool& tool,
                                    const Eigen::VectorXd& theta);

}  // namespace cellcal::calib::testing
