#include "calib/model/kinematics.h"

#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace cellcal::calib {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kDegPerRad = 180.0 / std::numbers::pi;
constexpr double kArcsecPerRad = 3600.0 * kDegPerRad;

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

const char* suffix(JointError error) {
  switch (error) {
    case JointError::kTheta:
      return ".theta";
    case JointError::kD:
      return ".d";
    case JointError::kA:
      return ".a";
    case JointError::kAlpha:
      return ".alpha";
    case JointError::kBeta:
      return ".beta";
  }
  return "";
}

ArmParameterKind kind_of(JointError error) {
  switch (error) {
    case JointError::kTheta:
      return ArmParameterKind::kTheta;
    case JointError::kD:
      return ArmParameterKind::kD;
    case JointError::kA:
      return ArmParameterKind::kA;
    case JointError::kAlpha:
      return ArmParameterKind::kAlpha;
    case JointError::kBeta:
      return ArmParameterKind::kBeta;
  }
  return ArmParameterKind::kTheta;
}

/// The link frame's axis is the one that the joint turns about.
bool along_own_axis(const Joint& joint, int axis) {
  const Matrix3d turn = (Eigen::AngleAxisd(joint.alpha_rad, Vector3d::UnitX()) *
                         Eigen::AngleAxisd(joint.beta_rad, Vector3d::UnitY()))
                            .toRotationMatrix();
  constexpr double kRounding = 1e-9;
  return std::abs(turn(2, axis)) > 1.0 - kRounding;
}

bool is_length(JointError error) { return error == JointError::kD || error == JointError::kA; }

}  // namespace

ArmModel::ArmModel(const Robot& robot, const Tool& tool)
    : robot_(robot),
      tool_(tool),
      stiff_(tool.mass_kg * tool.length_m * tool.length_m * tool.length_m / 3.0) {
  if (robot.joints.empty() || robot.joints.size() > kMaxJoints)
    throw std::invalid_argument("ArmModel: a robot needs 1 to " + std::to_string(kMaxJoints) +
                                " joints, but has " + std::to_string(robot.joints.size()));
  for (int i = 0; i < joint_count(); ++i) {
    const Joint& joint = robot_.joints[i];
    for (JointError error : joint.errors) {
      const bool length = is_length(error);
      const double sigma = length ? joint.tolerance_length_m : joint.tolerance_angle_rad;
      if (sigma <= 0.0) continue;
      parameters_.push_back({kind_of(error), i, 0, 0, sigma, joint.name + suffix(error),
                             length ? "mm" : "deg", length ? 1000.0 : kDegPerRad});
    }
  }
  first_by_pose_ = size();
  for (int i = 0; i < joint_count(); ++i) {
    const Joint& joint = robot_.joints[i];
    if (joint.compliance_sigma_rad_per_nm > 0.0)
      parameters_.push_back({ArmParameterKind::kCompliance, i, 0, 0,
                             joint.compliance_sigma_rad_per_nm, joint.name + ".compliance",
                             "rad/(N m)", 1.0});
  }
  for (int i = 0; i < joint_count(); ++i) {
    const Joint& joint = robot_.joints[i];
    if (joint.compliance_sigma_rad_per_nm <= 0.0) continue;
    for (int j = i; j < joint_count(); ++j) {
      const Joint& link = robot_.joints[j];
      constexpr std::array kAxis = {"_x", "_y", "_z"};
      for (int axis = 0; axis < 3 && link.moment_sigma_kg_m > 0.0; ++axis) {
        if (j == i && along_own_axis(link, axis)) continue;  // does not load its own joint
        parameters_.push_back({ArmParameterKind::kLoad, i, 0, axis,
                               joint.compliance_sigma_rad_per_nm * link.moment_sigma_kg_m,
                               joint.name + ".load_" + link.name + kAxis[axis], "kg m rad/(N m)",
                               1.0, j});
      }
    }
  }
  for (int i = 0; i < joint_count(); ++i) {
    const Joint& joint = robot_.joints[i];
    if (joint.harmonic_sigma_rad <= 0.0) continue;
    for (int h : joint.harmonics) {
      const std::string order = std::to_string(h);
      parameters_.push_back({ArmParameterKind::kCosine, i, h, 0, joint.harmonic_sigma_rad,
                             joint.name + ".cos" + order, "arcsec", kArcsecPerRad});
      parameters_.push_back({ArmParameterKind::kSine, i, h, 0, joint.harmonic_sigma_rad,
                             joint.name + ".sin" + order, "arcsec", kArcsecPerRad});
    }
  }
  last_by_pose_ = size();
  if (tool_.deflection_sigma > 0.0) {
    deflection_index_ = size();
    parameters_.push_back({ArmParameterKind::kDeflection, -1, 0, 0, tool_.deflection_sigma,
                           "tool.c_t", "1/(N m^2)", 1.0});
  }
  constexpr std::array kAxisName = {"tool.x", "tool.y", "tool.z"};
  for (int axis = 0; axis < 3; ++axis)
    if (tool_.tcp_sigma_m[axis] > 0.0)
      parameters_.push_back({ArmParameterKind::kTcp, -1, 0, axis, tool_.tcp_sigma_m[axis],
                             kAxisName[axis], "mm", 1000.0});
  none_ = errors(nullptr);
}

/// Without what depends on the pose in other ways than by its directions.
PreparedPose ArmModel::turned(std::span<const double> joint_rad) const {
  if (joint_rad.size() != robot_.joints.size())
    throw std::invalid_argument("ArmModel::prepare: " + std::to_string(joint_rad.size()) +
                                " joint angles for a robot of " +
                                std::to_string(robot_.joints.size()) + " joints");
  PreparedPose pose;
  pose.direction.resize(2, joint_count());
  for (int i = 0; i < joint_count(); ++i) {
    const double theta = robot_.joints[i].sign * joint_rad[i] + robot_.joints[i].offset_rad;
    pose.direction.col(i) << std::cos(theta), std::sin(theta);
  }
  return pose;
}

PreparedPose ArmModel::prepare(std::span<const double> joint_rad) const {
  PreparedPose pose = turned(joint_rad);
  pose.factor = Eigen::VectorXd::Zero(size());
  Eigen::VectorXd torque;
  ArmChain chain;
  Direction first{1.0, 0.0}, wave{1.0, 0.0};  // of the gear, of its harmonic
  int joint = -1, harmonic = 0;
  for (int p = first_by_pose_; p < last_by_pose_; ++p) {
    const ArmParameter& parameter = parameters_[p];
    switch (parameter.kind) {
      case ArmParameterKind::kCompliance:
        if (torque.size() == 0) {
          walk_links(pose, none_, chain);
          torque = gravity_torque_nm(chain);
        }
        pose.factor[p] = torque[parameter.joint];
        break;
      case ArmParameterKind::kLoad:  // behind kCompliance: chain is walked
        pose.factor[p] = chain.link[parameter.joint].z.dot(
            chain.link[parameter.link].rotation.col(parameter.axis).cross(robot_.gravity_m_s2));
        break;
      case ArmParameterKind::kCosine: {  // a joint's follow one another, sine behind cosine
        if (joint != parameter.joint || parameter.harmonic < harmonic) {
          joint = parameter.joint;
          harmonic = 0;
          const double phase = joint_rad[joint] * robot_.joints[joint].gear_ratio;
          first = {std::cos(phase), std::sin(phase)};
          wave = {1.0, 0.0};
        }
        constexpr int kSteps = 4;  // beyond: by the angle, before rounding adds up
        if (parameter.harmonic - harmonic > kSteps) {
          const double phase =
              parameter.harmonic * joint_rad[joint] * robot_.joints[joint].gear_ratio;
          wave = {std::cos(phase), std::sin(phase)};
          harmonic = parameter.harmonic;
        }
        for (; harmonic < parameter.harmonic; ++harmonic)
          wave = {wave.c * first.c - wave.s * first.s, wave.s * first.c + wave.c * first.s};
        pose.factor[p] = wave.c;
        break;
      }
      default:
        pose.factor[p] = wave.s;
        break;
    }
  }
  return pose;
}

ArmErrors ArmModel::errors(const double* x) const {
  ArmErrors e;
  e.x = x;
  e.tcp_m = tool_.tcp.translation();
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
      case ArmParameterKind::kTheta:
        e.joint[parameter.joint].theta_rad += x[p];
        break;
      case ArmParameterKind::kD:
        e.joint[parameter.joint].d_m += x[p];
        break;
      case ArmParameterKind::kA:
        e.joint[parameter.joint].a_m += x[p];
        break;
      case ArmParameterKind::kAlpha:
        alpha[parameter.joint] += x[p];
        break;
      case ArmParameterKind::kBeta:
        beta[parameter.joint] += x[p];
        break;
      case ArmParameterKind::kDeflection:
        e.bend_m_per_accel = x[p] * stiff_;
        break;
      case ArmParameterKind::kTcp:
        e.tcp_m[parameter.axis] += x[p];
        break;
      case ArmParameterKind::kCompliance:
      case ArmParameterKind::kLoad:
      case ArmParameterKind::kCosine:
      case ArmParameterKind::kSine:
        break;  // by the pose
    }
  }
  for (int i = 0; i < joint_count(); ++i) {
    ArmErrors::OfJoint& joint = e.joint[i];
    joint.cos_alpha = std::cos(alpha[i]);
    joint.sin_alpha = std::sin(alpha[i]);
    joint.has_beta = beta[i] != 0.0;
    joint.cos_beta = std::cos(beta[i]);
    joint.sin_beta = std::sin(beta[i]);
  }
  return e;
}

void ArmModel::walk_links(const PreparedPose& pose, const ArmErrors& errors,
                          ArmChain& chain) const {
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
    turn_z(rotation, c * off.c - s * off.s, s * off.c + c * off.s);
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
  chain.rigid_tip = chain.flange_origin + chain.flange * errors.tcp_m;
  chain.tip = chain.rigid_tip + errors.bend_m_per_accel * (g - g.dot(z) * z);
}

Eigen::VectorXd ArmModel::gravity_torque_nm(const ArmChain& chain) const {
  // From the flange inwards: the mass that hangs on joint i is its link's and all further ones'.
  Vector3d moment_sum = tool_.mass_kg * (chain.flange_origin + chain.flange * tool_.com_m);
  double mass_sum = tool_.mass_kg;
  Eigen::VectorXd torque(joint_count());
  for (int i = joint_count() - 1; i >= 0; --i) {
    const Joint& joint = robot_.joints[i];
    const ArmChain::Link& link = chain.link[i];
    moment_sum += joint.mass_kg * (link.end + link.rotation * joint.com_m);
    mass_sum += joint.mass_kg;
    const Vector3d lever = moment_sum - mass_sum * link.z_origin;  // kg m
    torque[i] = link.z.dot(lever.cross(robot_.gravity_m_s2));
  }
  return torque;
}

Vector3d ArmModel::position(const PreparedPose& pose, const double* x) const {
  ArmChain chain;
  if (x == nullptr)
    walk(pose, none_, chain);
  else
    walk(pose, errors(x), chain);
  return chain.tip;
}

Vector3d ArmModel::position(const PreparedPose& pose, const double* x,
                            Eigen::Ref<Eigen::Matrix3Xd> jacobian) const {
  const ArmErrors at = errors(x);
  ArmChain chain;
  walk(pose, at, chain);
  derivative(pose, at, chain, jacobian);
  return chain.tip;
}

void ArmModel::derivative_along(const Vector3d& n, const PreparedPose& pose,
                                const ArmErrors& errors, const ArmChain& chain, double* derivative,
                                std::ptrdiff_t stride) const {
  const Vector3d z = chain.flange.col(2);
  const Vector3d& g = robot_.gravity_m_s2;
  const double bend = errors.bend_m_per_accel;
  // A turn about w through o carries the rigid tip t along and swings the flange's z, and with it
  // the direction in which the tool bends, b (g - (g.z) z):
  //   dp = w x (t - o) - b [ g.(w x z) z + (g.z) w x z ]
  // Along n that is w.[ t x n - b ((z.n) z x g + (g.z) z x n) - o x n ].
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
      case ArmParameterKind::kTheta:
        out = by_theta[parameter.joint];
        break;
      case ArmParameterKind::kD:
        out = link.z.dot(n);
        break;
      case ArmParameterKind::kA:
        out = link.x.dot(n);
        break;
      case ArmParameterKind::kAlpha:
        out = turn(link.x, link.end);
        break;
      default:  // beta is the last of a joint's own
        out = turn(link.y, link.end);
        break;
    }
  }
  for (int p = first_by_pose_; p < last_by_pose_; ++p)
    derivative[p * stride] = pose.factor[p] * by_theta[parameters_[p].joint];
  for (int p = last_by_pose_; p < size(); ++p)
    derivative[p * stride] = parameters_[p].kind == ArmParameterKind::kDeflection
                                 ? stiff_ * (g.dot(n) - g.dot(z) * z.dot(n))
                                 : chain.flange.col(parameters_[p].axis).dot(n);
}

void ArmModel::derivative(const PreparedPose& pose, const ArmErrors& errors, const ArmChain& chain,
                          Eigen::Ref<Eigen::Matrix3Xd> jacobian) const {
  for (int axis = 0; axis < 3; ++axis)
    derivative_along(Vector3d::Unit(axis), pose, errors, chain, jacobian.data() + axis,
                     jacobian.outerStride());
}

ArmShape ArmModel::shape(const PreparedPose& pose, const double* x) const {
  const ArmErrors at = errors(x);
  ArmChain chain;
  walk(pose, at, chain);
  ArmShape shape;
  for (int i = 0; i < joint_count(); ++i) shape.joint_origin_m.push_back(chain.link[i].z_origin);
  shape.joint_origin_m.push_back(chain.flange_origin);
  shape.flange.linear() = chain.flange;
  shape.flange.translation() = chain.flange_origin;
  shape.flange.makeAffine();
  const double c_t = x != nullptr && deflection_index_ >= 0 ? x[deflection_index_] : 0.0;
  const Vector3d z = chain.flange.col(2);
  const Vector3d turn =
      c_t * tool_.mass_kg * tool_.length_m * tool_.length_m / 2.0 * z.cross(robot_.gravity_m_s2);
  const Matrix3d swing = turn.norm() > 0.0
                             ? Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix()
                             : Matrix3d::Identity();
  shape.tcp.linear() = swing * chain.flange * tool_.tcp.linear();
  shape.tcp.translation() = chain.tip;
  shape.tcp.makeAffine();
  return shape;
}

Eigen::Isometry3d ArmModel::nominal_tcp(std::span<const double> joint_rad) const {
  ArmChain chain;
  walk(turned(joint_rad), none_, chain);
  Eigen::Isometry3d tcp;
  tcp.linear() = chain.flange * tool_.tcp.linear();
  tcp.translation() = chain.tip;
  tcp.makeAffine();
  return tcp;
}

Vector3d ArmModel::nominal_tip_m(std::span<const double> joint_rad) const {
  ArmChain chain;
  walk(turned(joint_rad), none_, chain);
  return chain.tip;
}

Eigen::Matrix<double, 6, Eigen::Dynamic> ArmModel::nominal_jacobian(
    std::span<const double> joint_rad) const {
  ArmChain chain;
  walk(turned(joint_rad), none_, chain);
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(6, joint_count());
  for (int i = 0; i < joint_count(); ++i) {
    const Vector3d axis = robot_.joints[i].sign * chain.link[i].z;
    jacobian.col(i) << axis.cross(chain.tip - chain.link[i].z_origin), axis;
  }
  return jacobian;
}

}  // namespace cellcal::calib
