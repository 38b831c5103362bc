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
constexpr int kMaxJoints = 32;  // bounds the stack; more is refused by the constructor

/// R * Rz(angle) without building the elementary rotation: mixes columns x and y.
void turn_z(Matrix3d& r, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  const Vector3d x = r.col(0);
  r.col(0) = c * x + s * r.col(1);
  r.col(1) = c * r.col(1) - s * x;
}

void turn_x(Matrix3d& r, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  const Vector3d y = r.col(1);
  r.col(1) = c * y + s * r.col(2);
  r.col(2) = c * r.col(2) - s * y;
}

void turn_y(Matrix3d& r, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  const Vector3d z = r.col(2);
  r.col(2) = c * z + s * r.col(0);
  r.col(0) = c * r.col(0) - s * z;
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

/// Axes and origins along the chain, base frame, under the errors.
struct ArmModel::Chain {
  struct Link {
    Vector3d z, z_origin;  // theta and d act along/about z through z_origin
    Vector3d x;            // a acts along x; alpha about x through end
    Vector3d y;            // beta about y through end
    Vector3d end;          // origin behind the joint
    Matrix3d rotation;     // behind the joint
  };
  std::array<Link, kMaxJoints> link;
  Matrix3d flange;
  Vector3d flange_origin;
};

ArmModel::ArmModel(const Robot& robot, const Tool& tool) : robot_(robot), tool_(tool) {
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
}

PreparedPose ArmModel::prepare(std::span<const double> joint_rad) const {
  if (joint_rad.size() != robot_.joints.size())
    throw std::invalid_argument("ArmModel::prepare: " + std::to_string(joint_rad.size()) +
                                " joint angles for a robot of " +
                                std::to_string(robot_.joints.size()) + " joints");
  PreparedPose pose;
  pose.theta_rad.resize(joint_count());
  for (int i = 0; i < joint_count(); ++i)
    pose.theta_rad[i] = robot_.joints[i].sign * joint_rad[i] + robot_.joints[i].offset_rad;
  pose.factor = Eigen::VectorXd::Zero(size());
  Eigen::VectorXd torque;
  Chain chain;
  for (int p = 0; p < size(); ++p) {
    const ArmParameter& parameter = parameters_[p];
    if (parameter.kind == ArmParameterKind::kCompliance) {
      if (torque.size() == 0) {
        walk(pose, nullptr, chain);
        torque = gravity_torque_nm(chain);
      }
      pose.factor[p] = torque[parameter.joint];
    } else if (parameter.kind == ArmParameterKind::kLoad) {  // behind kCompliance: chain is walked
      pose.factor[p] = chain.link[parameter.joint].z.dot(
          chain.link[parameter.link].rotation.col(parameter.axis).cross(robot_.gravity_m_s2));
    } else if (parameter.kind == ArmParameterKind::kCosine ||
               parameter.kind == ArmParameterKind::kSine) {
      const double phase = parameter.harmonic * joint_rad[parameter.joint] *
                           robot_.joints[parameter.joint].gear_ratio;
      pose.factor[p] =
          parameter.kind == ArmParameterKind::kCosine ? std::cos(phase) : std::sin(phase);
    }
  }
  return pose;
}

void ArmModel::walk(const PreparedPose& pose, const double* x, Chain& chain) const {
  // Errors per joint, gathered from the flat list.
  struct Error {
    double theta = 0, d = 0, a = 0, alpha = 0, beta = 0;
  };
  std::array<Error, kMaxJoints> error{};
  if (x != nullptr) {
    for (int p = 0; p < size(); ++p) {
      const ArmParameter& parameter = parameters_[p];
      if (parameter.joint < 0) continue;
      Error& e = error[parameter.joint];
      switch (parameter.kind) {
        case ArmParameterKind::kTheta:
          e.theta += x[p];
          break;
        case ArmParameterKind::kD:
          e.d += x[p];
          break;
        case ArmParameterKind::kA:
          e.a += x[p];
          break;
        case ArmParameterKind::kAlpha:
          e.alpha += x[p];
          break;
        case ArmParameterKind::kBeta:
          e.beta += x[p];
          break;
        case ArmParameterKind::kCompliance:
        case ArmParameterKind::kLoad:
        case ArmParameterKind::kCosine:
        case ArmParameterKind::kSine:
          e.theta += x[p] * pose.factor[p];
          break;
        case ArmParameterKind::kDeflection:
        case ArmParameterKind::kTcp:
          break;
      }
    }
  }
  Matrix3d rotation = robot_.base_fixed.linear();
  Vector3d origin = robot_.base_fixed.translation();
  for (int i = 0; i < joint_count(); ++i) {
    const Joint& joint = robot_.joints[i];
    Chain::Link& link = chain.link[i];
    link.z = rotation.col(2);
    link.z_origin = origin;
    turn_z(rotation, pose.theta_rad[i] + error[i].theta);
    link.x = rotation.col(0);
    origin += (joint.d_m + error[i].d) * link.z + (joint.a_m + error[i].a) * link.x;
    turn_x(rotation, joint.alpha_rad + error[i].alpha);
    link.y = rotation.col(1);
    if (const double beta = joint.beta_rad + error[i].beta; beta != 0.0) turn_y(rotation, beta);
    link.end = origin;
    link.rotation = rotation;
  }
  chain.flange_origin = origin + rotation * robot_.flange_fixed.translation();
  chain.flange = rotation * robot_.flange_fixed.linear();
}

Eigen::VectorXd ArmModel::gravity_torque_nm(const Chain& chain) const {
  // From the flange inwards: the mass that hangs on joint i is its link's and all further ones'.
  Vector3d moment_sum = tool_.mass_kg * (chain.flange_origin + chain.flange * tool_.com_m);
  double mass_sum = tool_.mass_kg;
  Eigen::VectorXd torque(joint_count());
  for (int i = joint_count() - 1; i >= 0; --i) {
    const Joint& joint = robot_.joints[i];
    const Chain::Link& link = chain.link[i];
    moment_sum += joint.mass_kg * (link.end + link.rotation * joint.com_m);
    mass_sum += joint.mass_kg;
    const Vector3d lever = moment_sum - mass_sum * link.z_origin;  // kg m
    torque[i] = link.z.dot(lever.cross(robot_.gravity_m_s2));
  }
  return torque;
}

Vector3d ArmModel::position(const PreparedPose& pose, const double* x) const {
  Chain chain;
  walk(pose, x, chain);
  Vector3d tcp = tool_.tcp.translation();
  double c_t = 0.0;
  if (x != nullptr) {
    for (int p = 0; p < size(); ++p)
      if (parameters_[p].kind == ArmParameterKind::kTcp) tcp[parameters_[p].axis] += x[p];
    if (deflection_index_ >= 0) c_t = x[deflection_index_];
  }
  const Vector3d z = chain.flange.col(2);
  const Vector3d& g = robot_.gravity_m_s2;
  const double stiff = tool_.mass_kg * std::pow(tool_.length_m, 3) / 3.0;
  return chain.flange_origin + chain.flange * tcp + c_t * stiff * (g - g.dot(z) * z);
}

Vector3d ArmModel::position(const PreparedPose& pose, const double* x,
                            Eigen::Ref<Eigen::Matrix3Xd> jacobian) const {
  Chain chain;
  walk(pose, x, chain);
  Vector3d tcp = tool_.tcp.translation();
  double c_t = 0.0;
  if (x != nullptr) {
    for (int p = 0; p < size(); ++p)
      if (parameters_[p].kind == ArmParameterKind::kTcp) tcp[parameters_[p].axis] += x[p];
    if (deflection_index_ >= 0) c_t = x[deflection_index_];
  }
  const Vector3d z = chain.flange.col(2);
  const Vector3d& g = robot_.gravity_m_s2;
  const double gz = g.dot(z);
  const double stiff = tool_.mass_kg * tool_.length_m * tool_.length_m * tool_.length_m / 3.0;
  const double bend = c_t * stiff;
  const Vector3d rigid = chain.flange_origin + chain.flange * tcp;
  const Vector3d across = g - gz * z;

  // A turn about `axis` through `point` carries the rigid tip along and swings the flange's z,
  // and with it the direction in which the tool bends.
  const auto turn = [&](const Vector3d& axis, const Vector3d& point) -> Vector3d {
    Vector3d dp = axis.cross(rigid - point);
    if (bend != 0.0) {
      const Vector3d dz = axis.cross(z);
      dp -= bend * (g.dot(dz) * z + gz * dz);
    }
    return dp;
  };
  // Each joint's turn about z serves theta, compliance and harmonics.
  std::array<Vector3d, kMaxJoints> turn_z_of;
  for (int i = 0; i < joint_count(); ++i)
    turn_z_of[i] = turn(chain.link[i].z, chain.link[i].z_origin);

  for (int p = 0; p < size(); ++p) {
    const ArmParameter& parameter = parameters_[p];
    const Chain::Link& link = chain.link[parameter.joint < 0 ? 0 : parameter.joint];
    switch (parameter.kind) {
      case ArmParameterKind::kTheta:
        jacobian.col(p) = turn_z_of[parameter.joint];
        break;
      case ArmParameterKind::kD:
        jacobian.col(p) = link.z;
        break;
      case ArmParameterKind::kA:
        jacobian.col(p) = link.x;
        break;
      case ArmParameterKind::kAlpha:
        jacobian.col(p) = turn(link.x, link.end);
        break;
      case ArmParameterKind::kBeta:
        jacobian.col(p) = turn(link.y, link.end);
        break;
      case ArmParameterKind::kCompliance:
      case ArmParameterKind::kLoad:
      case ArmParameterKind::kCosine:
      case ArmParameterKind::kSine:
        jacobian.col(p) = pose.factor[p] * turn_z_of[parameter.joint];
        break;
      case ArmParameterKind::kDeflection:
        jacobian.col(p) = stiff * across;
        break;
      case ArmParameterKind::kTcp:
        jacobian.col(p) = chain.flange.col(parameter.axis);
        break;
    }
  }
  return rigid + bend * across;
}

ArmShape ArmModel::shape(const PreparedPose& pose, const double* x) const {
  Chain chain;
  walk(pose, x, chain);
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
  shape.tcp.translation() = position(pose, x);
  shape.tcp.makeAffine();
  return shape;
}

Eigen::Isometry3d ArmModel::nominal_tcp(std::span<const double> joint_rad) const {
  return shape(prepare(joint_rad), nullptr).tcp;
}

Eigen::Matrix<double, 6, Eigen::Dynamic> ArmModel::nominal_jacobian(
    std::span<const double> joint_rad) const {
  const PreparedPose pose = prepare(joint_rad);
  Chain chain;
  walk(pose, nullptr, chain);
  const Vector3d tip = chain.flange_origin + chain.flange * tool_.tcp.translation();
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(6, joint_count());
  for (int i = 0; i < joint_count(); ++i) {
    const Vector3d axis = robot_.joints[i].sign * chain.link[i].z;
    jacobian.col(i) << axis.cross(tip - chain.link[i].z_origin), axis;
  }
  return jacobian;
}

}  // namespace cellcal::calib
