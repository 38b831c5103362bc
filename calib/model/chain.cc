// What the arm does under its errors: the chain, and its derivatives.

#include <array>
#include <cmath>

#include "calib/model/kinematics.h"
#include "calib/model/turn.h"

namespace cellcal::calib {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// R * Rz without building the elementary rotation: mixes columns x and y.
void turn_z(Matrix3d& r, double c, double s) {
  const Vector3d x = r.col(0);
  r.col(0) = c * x + s * r.col(1);
  r.col(1) = c * r.col(1) - s * x;
}

void turn_x(Matrix3d& r, double c, double s) {
  const Vector3d y = r.col(1);
  r.col(1) = c * y + s * r.col(2);
  r.col(2) = c * r.col(2) - s * y;
}

void turn_y(Matrix3d& r, double c, double s) {
  const Vector3d z = r.col(2);
  r.col(2) = c * z + s * r.col(0);
  r.col(0) = c * r.col(0) - s * z;
}

/// Cosine and sine.
struct Direction {
  double c, s;
};
/// Of an error, which is small nearly always: the series to 5e-20 there.
Direction direction(double angle) {
  constexpr double kSmall = 0.02;
  if (std::abs(angle) > kSmall) return {std::cos(angle), std::sin(angle)};
  const double q = angle * angle;
  return {1.0 - q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0))),
          angle * (1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0)))};
}

/// How a tool gives way by c_t; `stiff`: its m l^3/3.
void set_deflection(double c, const Tool& tool, double stiff, ArmErrors::OfTool& its) {
  its.bend_m_per_accel = c * stiff;
  its.turn_rad_per_accel = c * tool.mass_kg * tool.length_m * tool.length_m / 2.0;
}

void set_twist(double alpha, double beta, ArmErrors::OfJoint& its) {
  its.cos_alpha = std::cos(alpha);
  its.sin_alpha = std::sin(alpha);
  its.has_beta = beta != 0.0;
  its.cos_beta = std::cos(beta);
  its.sin_beta = std::sin(beta);
}

}  // namespace

ArmErrors ArmModel::errors(const double* x) const {
  ArmErrors e;
  e.x = x;
  for (int k = 0; k < tool_count(); ++k)
    e.tool[static_cast<std::size_t>(k)] = {tool(k).tcp.translation(), 0.0, 0.0};
  std::array<double, kMaxJoints> alpha, beta;
  for (int i = 0; i < joint_count(); ++i) {
    const Joint& joint = robot_.joints[i];
    e.joint[i].theta_rad = 0.0;
    e.joint[i].d_m = joint.d_m;
    e.joint[i].a_m = joint.a_m;
    alpha[i] = joint.alpha_rad;
    beta[i] = joint.beta_rad;
  }
  for (int p = 0; x != nullptr && p < size(); ++p) {
    const ArmParameter& parameter = parameters_[p];
    switch (parameter.kind) {
      case ParameterKind::kTheta:
        e.joint[parameter.joint].theta_rad += x[p];
        break;
      case ParameterKind::kD:
        e.joint[parameter.joint].d_m += x[p];
        break;
      case ParameterKind::kA:
        e.joint[parameter.joint].a_m += x[p];
        break;
      case ParameterKind::kAlpha:
        alpha[parameter.joint] += x[p];
        break;
      case ParameterKind::kBeta:
        beta[parameter.joint] += x[p];
        break;
      case ParameterKind::kDeflection:
        set_deflection(x[p], tool(parameter.tool), stiff_[parameter.tool], e.tool[parameter.tool]);
        break;
      case ParameterKind::kTcp:
        e.tool[parameter.tool].tcp_m[parameter.axis] += x[p];
        break;
      case ParameterKind::kCompliance:
      case ParameterKind::kLoad:
      case ParameterKind::kCosine:
      case ParameterKind::kSine:
      case ParameterKind::kPlay:
        break;  // by the pose
      default:
        break;  // not the arm's
    }
  }
  for (int i = 0; i < joint_count(); ++i) set_twist(alpha[i], beta[i], e.joint[i]);
  return e;
}

void ArmModel::walk_links(const PreparedPose& pose, const ArmErrors& errors,
                          ArmChain& chain) const {
  // (2): the errors in theta
  std::array<double, kMaxJoints> by_pose;
  for (int i = 0; i < joint_count(); ++i) by_pose[i] = errors.joint[i].theta_rad;
  if (errors.x != nullptr)
    for (int p = first_by_pose_; p < last_by_pose_; ++p)
      by_pose[parameters_[p].joint] += errors.x[p] * pose.factor[p];
  Matrix3d rotation = robot_.base_fixed.linear();
  Vector3d origin = robot_.base_fixed.translation();
  for (int i = 0; i < joint_count(); ++i) {
    const ArmErrors::OfJoint& joint = errors.joint[i];
    ArmChain::Link& link = chain.link[i];
    link.z = rotation.col(2);
    link.z_origin = origin;
    const Direction off = direction(by_pose[i]);
    const double c = pose.direction(0, i), s = pose.direction(1, i);
    turn_z(rotation, c * off.c - s * off.s, s * off.c + c * off.s);  // (1)
    link.x = rotation.col(0);
    origin += joint.d_m * link.z + joint.a_m * link.x;
    turn_x(rotation, joint.cos_alpha, joint.sin_alpha);
    link.y = rotation.col(1);
    if (joint.has_beta) turn_y(rotation, joint.cos_beta, joint.sin_beta);
    link.end = origin;
    link.rotation = rotation;
  }
  chain.flange_origin = origin + rotation * robot_.flange_fixed.translation();
  chain.flange = rotation * robot_.flange_fixed.linear();
}

void ArmModel::walk(const PreparedPose& pose, const ArmErrors& errors, ArmChain& chain) const {
  walk_links(pose, errors, chain);
  const Vector3d z = chain.flange.col(2);
  const Vector3d& g = robot_.gravity_m_s2;
  const ArmErrors::OfTool& tool = errors.tool[pose.tool];
  chain.rigid_tip = chain.flange_origin + chain.flange * tool.tcp_m;         // (3)
  chain.tip = chain.rigid_tip + tool.bend_m_per_accel * (g - g.dot(z) * z);  // (4)
}

void ArmModel::derivative_along(const Vector3d& n, const PreparedPose& pose,
                                const ArmErrors& errors, const ArmChain& chain, double* derivative,
                                std::ptrdiff_t stride) const {
  const Vector3d z = chain.flange.col(2);
  const Vector3d& g = robot_.gravity_m_s2;
  const double bend = errors.tool[pose.tool].bend_m_per_accel;
  // A turn about x_a through o carries the rigid tip p_0 along and swings the flange's z_t, and with
  // it the direction in which the tool bends, s_t (g - (g.z_t) z_t):
  // (7)  dp = x_a x (p_0 - o) - s_t [ g.(x_a x z_t) z_t + (g.z_t) (x_a x z_t) ]
  // Along n that is x_a.[ p_0 x n - s_t ((z_t.n) z_t x g + (g.z_t) z_t x n) - o x n ].
  const Vector3d swing =
      chain.rigid_tip.cross(n) - bend * (z.dot(n) * z.cross(g) + g.dot(z) * z.cross(n));
  const auto turn = [&](const Vector3d& axis, const Vector3d& point) {
    return axis.dot(swing - point.cross(n));
  };
  std::array<double, kMaxJoints> by_theta;
  for (int i = 0; i < joint_count(); ++i)
    by_theta[i] = turn(chain.link[i].z, chain.link[i].z_origin);
  for (int p = 0; p < first_by_pose_; ++p) {
    const ArmParameter& parameter = parameters_[p];
    const ArmChain::Link& link = chain.link[parameter.joint];
    double& out = derivative[p * stride];
    switch (parameter.kind) {
      case ParameterKind::kTheta:
        out = by_theta[parameter.joint];
        break;
      case ParameterKind::kD:
        out = link.z.dot(n);
        break;
      case ParameterKind::kA:
        out = link.x.dot(n);
        break;
      case ParameterKind::kAlpha:
        out = turn(link.x, link.end);
        break;
      default:  // beta is the last of a joint's own
        out = turn(link.y, link.end);
        break;
    }
  }
  for (int p = first_by_pose_; p < last_by_pose_; ++p)
    derivative[p * stride] = pose.factor[p] * by_theta[parameters_[p].joint];
  for (int p = last_by_pose_; p < size(); ++p) {
    const ArmParameter& parameter = parameters_[p];
    double& out = derivative[p * stride];
    if (parameter.tool != pose.tool)
      out = 0.0;
    else if (parameter.kind == ParameterKind::kDeflection)
      out = stiff_[parameter.tool] * (g.dot(n) - g.dot(z) * z.dot(n));
    else
      out = chain.flange.col(parameter.axis).dot(n);
  }
}

void ArmModel::derivative(const PreparedPose& pose, const ArmErrors& errors, const ArmChain& chain,
                          Eigen::Ref<Eigen::Matrix3Xd> jacobian) const {
  for (int axis = 0; axis < 3; ++axis)
    derivative_along(Vector3d::Unit(axis), pose, errors, chain, jacobian.data() + axis,
                     jacobian.outerStride());
}

Matrix3d ArmModel::rotation(const PreparedPose& pose, const ArmErrors& errors,
                            const ArmChain& chain) const {
  const Vector3d bend = errors.tool[pose.tool].turn_rad_per_accel *  // (5)
                        Vector3d(chain.flange.col(2)).cross(robot_.gravity_m_s2);
  return turn(bend) * chain.flange * tool(pose.tool).tcp.linear();
}

void ArmModel::turn_derivative(const PreparedPose& pose, const ArmErrors& errors,
                               const ArmChain& chain, Eigen::Ref<Eigen::Matrix3Xd> jacobian) const {
  const Vector3d z = chain.flange.col(2);
  const Vector3d& g = robot_.gravity_m_s2;
  const double per_accel = errors.tool[pose.tool].turn_rad_per_accel;
  const Vector3d bend = per_accel * z.cross(g);
  const Matrix3d bent = turn(bend), by_bend = calib::turn_derivative(bend);
  // A turn w of the flange is carried on by the bent tool, and changes how it hangs.
  const auto carried = [&](const Vector3d& w) {
    return Vector3d(bent * w + per_accel * (by_bend * w.cross(z).cross(g)));
  };
  for (int p = 0; p < size(); ++p) {
    const ArmParameter& parameter = parameters_[p];
    switch (parameter.kind) {
      case ParameterKind::kTheta:
        jacobian.col(p) = carried(chain.link[parameter.joint].z);
        break;
      case ParameterKind::kAlpha:
        jacobian.col(p) = carried(chain.link[parameter.joint].x);
        break;
      case ParameterKind::kBeta:
        jacobian.col(p) = carried(chain.link[parameter.joint].y);
        break;
      case ParameterKind::kCompliance:
      case ParameterKind::kLoad:
      case ParameterKind::kCosine:
      case ParameterKind::kSine:
      case ParameterKind::kPlay:
        jacobian.col(p) = carried(pose.factor[p] * chain.link[parameter.joint].z);
        break;
      case ParameterKind::kDeflection: {
        const Tool& own = tool(parameter.tool);
        const double per_unit =
            parameter.tool == pose.tool ? own.mass_kg * own.length_m * own.length_m / 2.0 : 0.0;
        jacobian.col(p) = per_unit * (by_bend * z.cross(g));
        break;
      }
      case ParameterKind::kD:
      case ParameterKind::kA:
      case ParameterKind::kTcp:
      default:  // what else there is is not the arm's
        jacobian.col(p).setZero();
        break;
    }
  }
}

}  // namespace cellcal::calib
