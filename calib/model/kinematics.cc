// Kinematic chain of the arm under its errors, and its derivatives.

#include "calib/model/kinematics.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "calib/model/turns.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Cosine and sine.
struct Turned {
  double c, s;
};
/// Axis of a bearing's tilt.
const Vector3d& tilt_axis(const ArmChain::Link& link, int axis) {
  return axis == 0 ? link.tilt_x : link.tilt_y;
}

/// (1b), of order 0 the slope [m] about the middle.
double guide_wave(const Joint& joint, int order, double position_m) {
  const double stroke_m = joint.max_rad - joint.min_rad;
  if (order == 0) return position_m - (joint.min_rad + joint.max_rad) / 2.0;
  return std::cos(order * std::numbers::pi * (position_m - joint.min_rad) / stroke_m);
}

/// Tool deflection by c_t; `stiff`: m l^3/3 of the tool.
void set_deflection(double c, const Tool& tool, double stiff, ArmErrors::OfTool& its) {
  its.bend_m_per_accel = c * stiff;
  its.turn_rad_per_accel = c * tool.mass_kg * tool.length_m * tool.length_m / 2.0;
}

/// (1a): the carriage from the frame `rotation`, `origin` on, by its six motions.
void carry(const Matrix3d& guide_axes, const std::array<double, kGuideMotions>& motion,
           Matrix3d& rotation, Vector3d& origin, ArmChain::Link& link) {
  Matrix3d axes = rotation * guide_axes;
  link.x = axes.col(0);
  link.y = axes.col(1);
  link.z = axes.col(2);
  link.z_origin = origin;
  origin += motion[0] * link.x + motion[1] * link.y + motion[2] * link.z;
  const Direction roll = direction(motion[3]), pitch = direction(motion[4]),
                  yaw = direction(motion[5]);
  link.turns.col(0) = axes.col(0);
  turn_x(axes, roll.c, roll.s);
  link.turns.col(1) = axes.col(1);
  turn_y(axes, pitch.c, pitch.s);
  link.turns.col(2) = axes.col(2);
  turn_z(axes, yaw.c, yaw.s);
  rotation = axes * guide_axes.transpose();
  link.end = origin;
  link.rotation = rotation;
}

void set_twist(double alpha, double beta, ArmErrors::OfJoint& its) {
  its.cos_alpha = std::cos(alpha);
  its.sin_alpha = std::sin(alpha);
  its.has_beta = beta != 0.0;
  its.cos_beta = std::cos(beta);
  its.sin_beta = std::sin(beta);
}

}  // namespace

bool ArmModel::has_tool(std::string_view id) const {
  return id.empty() || std::ranges::find(tools_, id, &Tool::id) != tools_.end();
}

int ArmModel::tool_index(std::string_view id) const {
  if (id.empty()) return 0;
  for (int k = 0; k < tool_count(); ++k)
    if (tool(k).id == id) return k;
  throw std::out_of_range("no tool \"" + std::string(id) + "\" on the flange");
}

const Load* ArmModel::load(std::string_view id) const {
  if (id.empty()) return nullptr;
  const auto found = std::ranges::find(loads_, id, &Load::id);
  if (found == loads_.end()) throw std::out_of_range("no load \"" + std::string(id) + "\"");
  return &*found;
}

/// Only the terms that depend on the pose through the directions.
PreparedPose ArmModel::turned(std::span<const double> joint_rad, int tool,
                              std::span<const double> carrier_rad,
                              std::span<const double> outer_rad) const {
  if (joint_rad.size() != robot_.joints.size())
    throw std::invalid_argument("ArmModel::prepare: " + std::to_string(joint_rad.size()) +
                                " joint angles for a robot of " +
                                std::to_string(robot_.joints.size()) + " joints");
  if (carrier_rad.size() + outer_rad.size() > robot_.positioner.size())
    throw std::invalid_argument(
        "ArmModel::prepare: " + std::to_string(carrier_rad.size() + outer_rad.size()) +
        " angles for a positioner of " + std::to_string(robot_.positioner.size()) + " axes");
  PreparedPose pose;
  pose.tool = tool;
  pose.carriers = static_cast<int>(carrier_rad.size());
  std::ranges::copy(carrier_rad, pose.carrier_rad.begin());
  pose.direction.resize(2, joint_count());
  for (int i = 0; i < joint_count(); ++i) {
    if (robot_.joints[i].is_prismatic()) {
      pose.direction.col(i) << joint_rad[i], 0.0;
      continue;
    }
    // (2), nominal; prepare() adds the factors of the other terms
    const double theta = robot_.joints[i].sign * joint_rad[i] + robot_.joints[i].offset_rad;
    pose.direction.col(i) << std::cos(theta), std::sin(theta);
  }
  return pose;
}

PreparedPose ArmModel::prepare(std::span<const double> joint_rad, int tool, const Load* load,
                               std::span<const double> carrier_rad,
                               std::span<const double> outer_rad) const {
  PreparedPose pose = turned(joint_rad, tool, carrier_rad, outer_rad);
  pose.factor = Eigen::VectorXd::Zero(size());
  if (pose.carriers > 0) prepare_positioner(outer_rad, pose);
  Eigen::Matrix3Xd moment;
  ArmChain chain;
  const auto moment_nm = [&](int joint) {
    if (moment.size() == 0) {
      walk_links(pose, none_, chain);
      moment = gravity_moment_nm(chain, load);
    }
    return moment.col(joint);
  };
  const auto torque_nm = [&](int joint) {
    const auto m = moment_nm(joint);
    return chain.link[joint].z.dot(m);  // (6)
  };
  Turned first{1.0, 0.0}, wave{1.0, 0.0};  // of the gear or joint, of its harmonic
  int joint = -1, harmonic = 0;
  ParameterKind series = ParameterKind::kCosine;
  for (int p = first_by_pose_; p < last_by_pose_; ++p) {
    const ArmParameter& parameter = parameters_[p];
    switch (parameter.kind) {
      case ParameterKind::kCompliance: pose.factor[p] = torque_nm(parameter.joint); break;
      case ParameterKind::kPlay:
        pose.factor[p] =
            std::tanh(torque_nm(parameter.joint) / robot_.joints[parameter.joint].play_closes_nm);
        break;
      case ParameterKind::kStiffening:
        pose.factor[p] =
            std::tanh(torque_nm(parameter.joint) / robot_.joints[parameter.joint].stiffening_nm);
        break;
      case ParameterKind::kLoad:  // after kCompliance: the chain is available
        pose.factor[p] = chain.link[parameter.joint].z.dot(
            chain.link[parameter.link].rotation.col(parameter.axis).cross(chain.gravity));
        break;
      case ParameterKind::kFunctionCosine:
      case ParameterKind::kCosine: {  // a joint's harmonics are consecutive, sine after cosine
        const double ratio = parameter.kind == ParameterKind::kCosine
                                 ? robot_.joints[parameter.joint].gear_ratio
                                 : 1.0;
        if (joint != parameter.joint || series != parameter.kind || parameter.harmonic < harmonic) {
          joint = parameter.joint;
          series = parameter.kind;
          harmonic = 0;
          const double phase = joint_rad[joint] * ratio;
          first = {std::cos(phase), std::sin(phase)};
          wave = {1.0, 0.0};
        }
        constexpr int kSteps = 4;  // beyond: from the angle, before rounding accumulates
        if (parameter.harmonic - harmonic > kSteps) {
          const double phase = parameter.harmonic * joint_rad[joint] * ratio;
          wave = {std::cos(phase), std::sin(phase)};
          harmonic = parameter.harmonic;
        }
        for (; harmonic < parameter.harmonic; ++harmonic)
          wave = {wave.c * first.c - wave.s * first.s, wave.s * first.c + wave.c * first.s};
        pose.factor[p] = wave.c;
        break;
      }
      default: pose.factor[p] = wave.s; break;
    }
  }
  for (int p = last_by_pose_; p < last_bearing_; ++p) {
    const auto m = moment_nm(parameters_[p].joint);
    const ArmChain::Link& link = chain.link[parameters_[p].joint];
    pose.factor[p] = m.dot(tilt_axis(link, parameters_[p].axis));
  }
  for (int p = last_bearing_; p < last_guide_; ++p)
    pose.factor[p] = guide_wave(robot_.joints[parameters_[p].joint], parameters_[p].harmonic,
                                joint_rad[parameters_[p].joint]);
  return pose;
}

Eigen::Matrix3Xd ArmModel::gravity_moment_nm(const ArmChain& chain, const Load* load) const {
  // From the flange inwards: joint i carries the mass of its link and of all further ones.
  Vector3d moment_sum = Vector3d::Zero();
  double mass_sum = 0.0;
  const auto carry = [&](double mass_kg, const Vector3d& com_m) {
    moment_sum += mass_kg * (chain.flange_origin + chain.flange * com_m);
    mass_sum += mass_kg;
  };
  for (const Tool& tool : tools_) carry(tool.mass_kg, tool.com_m);
  if (load) carry(load->mass_kg, load->com_m);
  Eigen::Matrix3Xd moment(3, joint_count());
  for (int i = joint_count() - 1; i >= 0; --i) {
    const Joint& joint = robot_.joints[i];
    const ArmChain::Link& link = chain.link[i];
    moment_sum += joint.mass_kg * (link.end + link.rotation * joint.com_m);
    mass_sum += joint.mass_kg;
    const Vector3d lever = moment_sum - mass_sum * link.z_origin;  // kg m
    moment.col(i) = lever.cross(chain.gravity);
  }
  return moment;
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

Eigen::Isometry3d ArmModel::nominal_tcp(std::span<const double> joint_rad, int index,
                                        std::span<const double> carrier_rad) const {
  ArmChain chain;
  walk(turned(joint_rad, index, carrier_rad), none_, chain);
  Eigen::Isometry3d tcp;
  tcp.linear() = chain.flange * tool(index).tcp.linear();
  tcp.translation() = chain.tip;
  tcp.makeAffine();
  return tcp;
}

Vector3d ArmModel::nominal_tip_m(std::span<const double> joint_rad, int index,
                                 std::span<const double> carrier_rad) const {
  ArmChain chain;
  walk(turned(joint_rad, index, carrier_rad), none_, chain);
  return chain.tip;
}

Eigen::Matrix<double, 6, Eigen::Dynamic> ArmModel::nominal_jacobian(
    std::span<const double> joint_rad) const {
  ArmChain chain;
  walk(turned(joint_rad, 0), none_, chain);
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(6, joint_count());
  for (int i = 0; i < joint_count(); ++i) {
    if (guide_axes_[i]) {
      jacobian.col(i) << chain.link[i].x, Vector3d::Zero();
      continue;
    }
    const Vector3d axis = robot_.joints[i].sign * chain.link[i].z;
    jacobian.col(i) << axis.cross(chain.tip - chain.link[i].z_origin), axis;
  }
  return jacobian;
}

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
      case ParameterKind::kTheta: e.joint[parameter.joint].theta_rad += x[p]; break;
      case ParameterKind::kD: e.joint[parameter.joint].d_m += x[p]; break;
      case ParameterKind::kA: e.joint[parameter.joint].a_m += x[p]; break;
      case ParameterKind::kAlpha: alpha[parameter.joint] += x[p]; break;
      case ParameterKind::kBeta: beta[parameter.joint] += x[p]; break;
      case ParameterKind::kDeflection:
        set_deflection(x[p], tool(parameter.tool), stiff_[parameter.tool], e.tool[parameter.tool]);
        break;
      case ParameterKind::kTcp: e.tool[parameter.tool].tcp_m[parameter.axis] += x[p]; break;
      case ParameterKind::kGuide:
      case ParameterKind::kCompliance:
      case ParameterKind::kLoad:
      case ParameterKind::kCosine:
      case ParameterKind::kSine:
      case ParameterKind::kFunctionCosine:
      case ParameterKind::kFunctionSine:
      case ParameterKind::kBearing:
      case ParameterKind::kStiffening:
      case ParameterKind::kPlay: break;  // depends on the pose
      default: break;                    // not of the arm
    }
  }
  for (int i = 0; i < joint_count(); ++i) set_twist(alpha[i], beta[i], e.joint[i]);
  return e;
}

std::array<double, kGuideMotions> ArmModel::guide_motion(int joint, const PreparedPose& pose,
                                                         const double* x) const {
  std::array<double, kGuideMotions> motion{pose.direction(0, joint)};
  if (x != nullptr)
    for (int p = last_bearing_; p < last_guide_; ++p)
      if (parameters_[p].joint == joint) motion[parameters_[p].axis] += x[p] * pose.factor[p];
  return motion;
}

void ArmModel::walk_links(const PreparedPose& pose, const ArmErrors& errors,
                          ArmChain& chain) const {
  // (2): the errors in theta
  std::array<double, kMaxJoints> by_pose;
  for (int i = 0; i < joint_count(); ++i) by_pose[i] = errors.joint[i].theta_rad;
  if (errors.x != nullptr)
    for (int p = first_by_pose_; p < last_by_pose_; ++p)
      by_pose[parameters_[p].joint] += errors.x[p] * pose.factor[p];
  std::array<std::array<double, 2>, kMaxJoints> across{};
  const bool bearings = last_bearing_ > last_by_pose_;
  if (errors.x != nullptr)
    for (int p = last_by_pose_; p < last_bearing_; ++p)
      across[parameters_[p].joint][parameters_[p].axis] = errors.x[p] * pose.factor[p];
  Matrix3d rotation = robot_.base_fixed.linear();
  Vector3d origin = robot_.base_fixed.translation();
  chain.gravity = robot_.gravity_m_s2;
  if (pose.carriers > 0) {
    const Eigen::Isometry3d base = base_of(pose, errors.x, chain);
    rotation = base.linear() * rotation;
    origin = base * origin;
    chain.gravity = base.linear() * chain.gravity;
  }
  for (int i = 0; i < joint_count(); ++i) {
    const ArmErrors::OfJoint& joint = errors.joint[i];
    ArmChain::Link& link = chain.link[i];
    if (guide_axes_[i]) {
      carry(*guide_axes_[i], guide_motion(i, pose, errors.x), rotation, origin, link);
      continue;
    }
    if (bearings) {
      const Direction about_x = direction(across[i][0]), about_y = direction(across[i][1]);
      link.tilt_x = rotation.col(0);
      turn_x(rotation, about_x.c, about_x.s);
      link.tilt_y = rotation.col(1);
      turn_y(rotation, about_y.c, about_y.s);
    }
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
  const Vector3d& g = chain.gravity;
  const ArmErrors::OfTool& tool = errors.tool[pose.tool];
  chain.rigid_tip = chain.flange_origin + chain.flange * tool.tcp_m;         // (3)
  chain.tip = chain.rigid_tip + tool.bend_m_per_accel * (g - g.dot(z) * z);  // (4)
}

void ArmModel::derivative_along(const Vector3d& n, const PreparedPose& pose,
                                const ArmErrors& errors, const ArmChain& chain, double* derivative,
                                std::ptrdiff_t stride) const {
  const Vector3d z = chain.flange.col(2);
  const Vector3d& g = chain.gravity;
  const double bend = errors.tool[pose.tool].bend_m_per_accel;
  // A rotation about x_a through o moves the rigid tip p_0 and turns the flange's z_t, and with it
  // the direction of the tool's bending, s_t (g - (g.z_t) z_t):
  //   (7)  dp = x_a x (p_0 - o) - s_t [ g.(x_a x z_t) z_t + (g.z_t) (x_a x z_t) ]
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
      case ParameterKind::kTheta: out = by_theta[parameter.joint]; break;
      case ParameterKind::kD: out = link.z.dot(n); break;
      case ParameterKind::kA: out = link.x.dot(n); break;
      case ParameterKind::kAlpha: out = turn(link.x, link.end); break;
      default:  // beta is a joint's last geometric error
        out = turn(link.y, link.end);
        break;
    }
  }
  for (int p = first_by_pose_; p < last_by_pose_; ++p)
    derivative[p * stride] = pose.factor[p] * by_theta[parameters_[p].joint];
  for (int p = last_by_pose_; p < last_bearing_; ++p) {
    const ArmChain::Link& link = chain.link[parameters_[p].joint];
    derivative[p * stride] =
        pose.factor[p] * turn(tilt_axis(link, parameters_[p].axis), link.z_origin);
  }
  for (int p = last_bearing_; p < last_guide_; ++p) {
    const ArmChain::Link& link = chain.link[parameters_[p].joint];
    const int axis = parameters_[p].axis % 3;
    const double by_motion = is_shift(GuideMotion{parameters_[p].axis})
                                 ? (axis == 0   ? link.x
                                    : axis == 1 ? link.y
                                                : link.z)
                                       .dot(n)
                                 : turn(link.turns.col(axis), link.end);
    derivative[p * stride] = pose.factor[p] * by_motion;
  }
  for (int p = last_guide_; p < last_tool_; ++p) {
    const ArmParameter& parameter = parameters_[p];
    double& out = derivative[p * stride];
    if (parameter.tool != pose.tool)
      out = 0.0;
    else if (parameter.kind == ParameterKind::kDeflection)
      out = stiff_[parameter.tool] * (g.dot(n) - g.dot(z) * z.dot(n));
    else
      out = chain.flange.col(parameter.axis).dot(n);
  }
  carrier_derivative(n, pose, chain, derivative, stride);
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
                        Vector3d(chain.flange.col(2)).cross(chain.gravity);
  return turn(bend) * chain.flange * tool(pose.tool).tcp.linear();
}

void ArmModel::turn_derivative(const PreparedPose& pose, const ArmErrors& errors,
                               const ArmChain& chain, Eigen::Ref<Eigen::Matrix3Xd> jacobian) const {
  const Vector3d z = chain.flange.col(2);
  const Vector3d& g = chain.gravity;
  const double per_accel = errors.tool[pose.tool].turn_rad_per_accel;
  const Vector3d bend = per_accel * z.cross(g);
  const Matrix3d bent = turn(bend), by_bend = calib::turn_derivative(bend);
  // The bent tool transmits a rotation w of the flange, which also changes its load direction.
  const auto carried = [&](const Vector3d& w) {
    return Vector3d(bent * w + per_accel * (by_bend * w.cross(z).cross(g)));
  };
  for (int p = 0; p < size(); ++p) {
    const ArmParameter& parameter = parameters_[p];
    switch (parameter.kind) {
      case ParameterKind::kTheta: jacobian.col(p) = carried(chain.link[parameter.joint].z); break;
      case ParameterKind::kAlpha: jacobian.col(p) = carried(chain.link[parameter.joint].x); break;
      case ParameterKind::kBeta: jacobian.col(p) = carried(chain.link[parameter.joint].y); break;
      case ParameterKind::kCompliance:
      case ParameterKind::kLoad:
      case ParameterKind::kCosine:
      case ParameterKind::kSine:
      case ParameterKind::kFunctionCosine:
      case ParameterKind::kFunctionSine:
      case ParameterKind::kStiffening:
      case ParameterKind::kPlay:
        jacobian.col(p) = carried(pose.factor[p] * chain.link[parameter.joint].z);
        break;
      case ParameterKind::kBearing:
        jacobian.col(p) =
            carried(pose.factor[p] * tilt_axis(chain.link[parameter.joint], parameter.axis));
        break;
      case ParameterKind::kGuide:
        if (is_shift(GuideMotion{parameter.axis}))
          jacobian.col(p).setZero();
        else
          jacobian.col(p) =
              carried(pose.factor[p] * chain.link[parameter.joint].turns.col(parameter.axis % 3));
        break;
      case ParameterKind::kDeflection: {
        const Tool& own = tool(parameter.tool);
        const double per_unit =
            parameter.tool == pose.tool ? own.mass_kg * own.length_m * own.length_m / 2.0 : 0.0;
        jacobian.col(p) = per_unit * (by_bend * z.cross(g));
        break;
      }
      case ParameterKind::kPositioner: {
        const auto j = static_cast<std::size_t>(parameter.carrier);
        if (parameter.carrier >= pose.carriers)
          jacobian.col(p).setZero();
        else
          jacobian.col(p) = pose.factor[p] * turn_by(chain.carrier[j], AxisError{parameter.axis});
        break;
      }
      case ParameterKind::kD:
      case ParameterKind::kA:
      case ParameterKind::kTcp:
      default:  // not of the arm
        jacobian.col(p).setZero();
        break;
    }
  }
}

}  // namespace cellcal::calib
