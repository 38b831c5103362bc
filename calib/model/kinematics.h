#pragma once
// The real arm as a function of its errors: forward kinematics with analytic derivatives.
//
// Model (calib/README.md §1-3). With the errors x put into the exact chain:
//   theta_i = s_i q_i + offset_i + dtheta_i + k_i tau_i(q) + sum_h a_ih cos(h q_i n_i) + b_ih
//   sin(..) T_i     = Rz(theta_i) Tz(d_i + dd_i) Tx(a_i + da_i) Rx(alpha_i + dalpha_i) Ry(beta_i +
//   dbeta_i) TCP     = flange * tool, then displaced by c_t m l^3/3 g_perp and turned by c_t m
//   l^2/2 (z x g)
// Where a link's mass moment m_j c_j is not known, each of its components adds k_i times its torque
// about joint i, one unknown per joint and component. tau_i is taken on the nominal geometry:
// errors of 1 mm and 1 mrad change it by parts in a thousand, which moves the tip by less than 10
// um on an arm that gives 5 mm.
//
// All parameters are SI and radians. Nothing here assumes six joints.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <string>
#include <vector>

#include "calib/model/robot.h"

namespace cellcal::calib {

enum class ArmParameterKind {
  kTheta,
  kD,
  kA,
  kAlpha,
  kBeta,        // geometric error of a joint
  kCompliance,  // k_i
  kLoad,        // k_i times an unknown part of a link's mass moment
  kCosine,
  kSine,        // transmission harmonic
  kDeflection,  // c_t
  kTcp          // one component of the tool's offset
};

struct ArmParameter {
  ArmParameterKind kind;
  int joint = -1;      ///< index; -1 for the tool's
  int harmonic = 0;    ///< order h
  int axis = 0;        ///< kTcp, kLoad: 0 x, 1 y, 2 z
  double sigma = 0.0;  ///< prior 1 sigma, > 0
  std::string name;    ///< "A1.theta", "A2.compliance", "A2.load_A4_x", "A3.cos2", "tool.c_t", ...
  std::string unit;    ///< of the value times to_unit
  double to_unit = 1.0;
  int link = -1;  ///< kLoad: the joint whose link it is
};

/// What depends on the axis angles alone and not on the errors; computed once per touch.
struct PreparedPose {
  Eigen::VectorXd theta_rad;  ///< nominal
  Eigen::VectorXd factor;     ///< per parameter: dtheta/dx for compliance, load, harmonics; else 0
};

/// Geometry of one pose under errors, for drawing and collision checks.
struct ArmShape {
  std::vector<Eigen::Vector3d> joint_origin_m;  ///< base frame; the last is the flange
  Eigen::Isometry3d flange;
  Eigen::Isometry3d tcp;
};

/// Robot with tool and the list of its possible errors. Immutable; safe to share among threads.
class ArmModel {
 public:
  ArmModel(const Robot& robot, const Tool& tool);

  const std::vector<ArmParameter>& parameters() const { return parameters_; }
  int size() const { return static_cast<int>(parameters_.size()); }
  int joint_count() const { return static_cast<int>(robot_.joints.size()); }
  const Robot& robot() const { return robot_; }
  const Tool& tool() const { return tool_; }

  /// Throws std::invalid_argument when the number of angles is not the robot's.
  PreparedPose prepare(std::span<const double> joint_rad) const;

  /// TCP position [m, base frame] at errors x (size() values; null: all zero).
  Eigen::Vector3d position(const PreparedPose& pose, const double* x) const;
  /// Same with its derivative, 3 x size(), column per parameter, column-major.
  Eigen::Vector3d position(const PreparedPose& pose, const double* x,
                           Eigen::Ref<Eigen::Matrix3Xd> jacobian) const;
  ArmShape shape(const PreparedPose& pose, const double* x) const;

  /// TCP pose of the nominal arm with a stiff tool.
  Eigen::Isometry3d nominal_tcp(std::span<const double> joint_rad) const;
  /// Geometric Jacobian of the nominal TCP, 6 x joints (linear above angular), per controller
  /// axis angle, base frame.
  Eigen::Matrix<double, 6, Eigen::Dynamic> nominal_jacobian(
      std::span<const double> joint_rad) const;

 private:
  struct Chain;
  void walk(const PreparedPose& pose, const double* x, Chain& chain) const;
  Eigen::VectorXd gravity_torque_nm(const Chain& chain) const;

  Robot robot_;
  Tool tool_;
  std::vector<ArmParameter> parameters_;
  int deflection_index_ = -1;
};

}  // namespace cellcal::calib
