#include "calib/model/kinematics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
constexpr double kArcsecPerRad = 3600.0 * kDegPerRad;

/// Cosine and sine.
struct Turned {
  double c, s;
};
ParameterKind kind_of(JointError error) {
  switch (error) {
    case JointError::kTheta:
      return ParameterKind::kTheta;
    case JointError::kD:
      return ParameterKind::kD;
    case JointError::kA:
      return ParameterKind::kA;
    case JointError::kAlpha:
      return ParameterKind::kAlpha;
    case JointError::kBeta:
      return ParameterKind::kBeta;
  }
  return ParameterKind::kTheta;
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

ArmModel::ArmModel(const Robot& robot, const Tool& tool, const std::vector<Tool>& others)
    : robot_(robot), tools_{tool} {
  tools_.insert(tools_.end(), others.begin(), others.end());
  if (tools_.size() > kMaxTools)
    throw std::invalid_argument("ArmModel: " + std::to_string(tools_.size()) +
                                " tools on one flange; at most " + std::to_string(kMaxTools));
  if (robot.joints.empty() || robot.joints.size() > kMaxJoints)
    throw std::invalid_argument("ArmModel: a robot needs 1 to " + std::to_string(kMaxJoints) +
                                " joints, but has " + std::to_string(robot.joints.size()));
  const std::size_t joints = robot_.joints.size();
  for (std::size_t at = 0; at < joints; ++at) {
    const Joint& joint = robot_.joints[at];
    for (JointError error : joint.errors) {
      const bool length = is_length(error);
      const double sigma = length ? joint.tolerance_length_m : joint.tolerance_angle_rad;
      if (sigma <= 0.0) continue;
      parameters_.push_back({joint_parameter(kind_of(error), at), sigma, length ? "mm" : "deg",
                             length ? 1000.0 : kDegPerRad});
    }
  }
  first_by_pose_ = size();
  for (std::size_t i = 0; i < joints; ++i) {
    const Joint& joint = robot_.joints[i];
    if (joint.compliance_sigma_rad_per_nm > 0.0)
      parameters_.push_back({joint_parameter(ParameterKind::kCompliance, i),
                             joint.compliance_sigma_rad_per_nm, "rad/(N m)", 1.0});
  }
  for (std::size_t i = 0; i < joints; ++i) {
    const Joint& joint = robot_.joints[i];
    if (joint.compliance_sigma_rad_per_nm <= 0.0) continue;
    for (std::size_t j = i; j < joints; ++j) {
      const Joint& link = robot_.joints[j];
      for (int axis = 0; axis < 3 && link.moment_sigma_kg_m > 0.0; ++axis) {
        if (j == i && along_own_axis(link, axis)) continue;  // does not load its own joint
        parameters_.push_back({load_parameter(i, j, axis),
                               joint.compliance_sigma_rad_per_nm * link.moment_sigma_kg_m,
                               "kg m rad/(N m)", 1.0});
      }
    }
  }
  for (std::size_t i = 0; i < joints; ++i) {
    const Joint& joint = robot_.joints[i];
    if (joint.play_sigma_rad > 0.0)
      parameters_.push_back({joint_parameter(ParameterKind::kPlay, i), joint.play_sigma_rad,
                             "arcsec", kArcsecPerRad});
  }
  for (std::size_t i = 0; i < joints; ++i) {
    const Joint& joint = robot_.joints[i];
    if (joint.harmonic_sigma_rad <= 0.0) continue;
    for (int h : joint.harmonics) {
      const double sigma = joint.harmonic_sigma_rad / std::pow(h, joint.harmonic_falloff);
      for (const ParameterKind kind : {ParameterKind::kCosine, ParameterKind::kSine})
        parameters_.push_back({wave_parameter(kind, i, h), sigma, "arcsec", kArcsecPerRad});
    }
  }
  last_by_pose_ = size();
  for (int k = 0; k < tool_count(); ++k) add_tool_parameters(k);
  none_ = errors(nullptr);
}

void ArmModel::add_tool_parameters(int index) {
  const Tool& tool = tools_[static_cast<std::size_t>(index)];
  stiff_.push_back(tool.mass_kg * tool.length_m * tool.length_m * tool.length_m / 3.0);
  const auto which = static_cast<std::size_t>(index);
  if (tool.deflection_sigma > 0.0)
    parameters_.push_back({tool_parameter(ParameterKind::kDeflection, which), tool.deflection_sigma,
                           "1/(N m^2)", 1.0});
  for (int axis = 0; axis < 3; ++axis)
    if (tool.tcp_sigma_m[axis] > 0.0)
      parameters_.push_back(
          {tool_parameter(ParameterKind::kTcp, which, axis), tool.tcp_sigma_m[axis], "mm", 1000.0});
}

bool ArmModel::has_tool(std::string_view id) const {
  return id.empty() || std::ranges::find(tools_, id, &Tool::id) != tools_.end();
}

int ArmModel::tool_index(std::string_view id) const {
  if (id.empty()) return 0;
  for (int k = 0; k < tool_count(); ++k)
    if (tool(k).id == id) return k;
  throw std::out_of_range("no tool \"" + std::string(id) + "\" on the flange");
}

/// Without what depends on the pose in other ways than by its directions.
PreparedPose ArmModel::turned(std::span<const double> joint_rad, int tool) const {
  if (joint_rad.size() != robot_.joints.size())
    throw std::invalid_argument("ArmModel::prepare: " + std::to_string(joint_rad.size()) +
                                " joint angles for a robot of " +
                                std::to_string(robot_.joints.size()) + " joints");
  PreparedPose pose;
  pose.tool = tool;
  pose.direction.resize(2, joint_count());
  for (int i = 0; i < joint_count(); ++i) {
    // (2), nominal; prepare() has what its other terms multiply
    const double theta = robot_.joints[i].sign * joint_rad[i] + robot_.joints[i].offset_rad;
    pose.direction.col(i) << std::cos(theta), std::sin(theta);
  }
  return pose;
}

PreparedPose ArmModel::prepare(std::span<const double> joint_rad, int tool) const {
  PreparedPose pose = turned(joint_rad, tool);
  pose.factor = Eigen::VectorXd::Zero(size());
  Eigen::VectorXd torque;
  ArmChain chain;
  const auto torque_nm = [&](int joint) {
    if (torque.size() == 0) {
      walk_links(pose, none_, chain);
      torque = gravity_torque_nm(chain);
    }
    return torque[joint];
  };
  Turned first{1.0, 0.0}, wave{1.0, 0.0};  // of the gear, of its harmonic
  int joint = -1, harmonic = 0;
  for (int p = first_by_pose_; p < last_by_pose_; ++p) {
    const ArmParameter& parameter = parameters_[p];
    switch (parameter.kind) {
      case ParameterKind::kCompliance:
        pose.factor[p] = torque_nm(parameter.joint);
        break;
      case ParameterKind::kPlay:
        pose.factor[p] =
            std::tanh(torque_nm(parameter.joint) / robot_.joints[parameter.joint].play_closes_nm);
        break;
      case ParameterKind::kLoad:  // behind kCompliance: chain is walked
        pose.factor[p] = chain.link[parameter.joint].z.dot(
            chain.link[parameter.link].rotation.col(parameter.axis).cross(robot_.gravity_m_s2));
        break;
      case ParameterKind::kCosine: {  // a joint's follow one another, sine behind cosine
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

Eigen::VectorXd ArmModel::gravity_torque_nm(const ArmChain& chain) const {
  // From the flange inwards: the mass that hangs on joint i is its link's and all further ones'.
  Vector3d moment_sum = Vector3d::Zero();
  double mass_sum = 0.0;
  for (const Tool& tool : tools_) {
    moment_sum += tool.mass_kg * (chain.flange_origin + chain.flange * tool.com_m);
    mass_sum += tool.mass_kg;
  }
  Eigen::VectorXd torque(joint_count());
  for (int i = joint_count() - 1; i >= 0; --i) {
    const Joint& joint = robot_.joints[i];
    const ArmChain::Link& link = chain.link[i];
    moment_sum += joint.mass_kg * (link.end + link.rotation * joint.com_m);
    mass_sum += joint.mass_kg;
    const Vector3d lever = moment_sum - mass_sum * link.z_origin;  // kg m
    torque[i] = link.z.dot(lever.cross(robot_.gravity_m_s2));      // (6)
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
  shape.tcp.linear() = rotation(pose, at, chain);
  shape.tcp.translation() = chain.tip;
  shape.tcp.makeAffine();
  return shape;
}

Eigen::Isometry3d ArmModel::nominal_tcp(std::span<const double> joint_rad, int index) const {
  ArmChain chain;
  walk(turned(joint_rad, index), none_, chain);
  Eigen::Isometry3d tcp;
  tcp.linear() = chain.flange * tool(index).tcp.linear();
  tcp.translation() = chain.tip;
  tcp.makeAffine();
  return tcp;
}

Vector3d ArmModel::nominal_tip_m(std::span<const double> joint_rad, int index) const {
  ArmChain chain;
  walk(turned(joint_rad, index), none_, chain);
  return chain.tip;
}

Eigen::Matrix<double, 6, Eigen::Dynamic> ArmModel::nominal_jacobian(
    std::span<const double> joint_rad) const {
  ArmChain chain;
  walk(turned(joint_rad, 0), none_, chain);
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(6, joint_count());
  for (int i = 0; i < joint_count(); ++i) {
    const Vector3d axis = robot_.joints[i].sign * chain.link[i].z;
    jacobian.col(i) << axis.cross(chain.tip - chain.link[i].z_origin), axis;
  }
  return jacobian;
}

}  // namespace cellcal::calib
