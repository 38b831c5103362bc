#include "tests/calib/model/naive_arm.h"

#include <cmath>

namespace cellcal::calib::testing {

namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

struct Link {
  double theta, d, a, alpha, beta;
  double tilt_x = 0.0, tilt_y = 0.0;  // of the joint's bearing
};

Isometry3d transform(const Link& link) {
  return Isometry3d(AngleAxisd(link.tilt_x, Vector3d::UnitX())) *
         AngleAxisd(link.tilt_y, Vector3d::UnitY()) * AngleAxisd(link.theta, Vector3d::UnitZ()) *
         Translation3d(0, 0, link.d) * Translation3d(link.a, 0, 0) *
         AngleAxisd(link.alpha, Vector3d::UnitX()) * AngleAxisd(link.beta, Vector3d::UnitY());
}

}  // namespace

Eigen::VectorXd nominal_theta(const Robot& robot, const JointVector& q) {
  Eigen::VectorXd theta(static_cast<Eigen::Index>(q.size()));
  for (std::size_t i = 0; i < q.size(); ++i)
    theta[static_cast<Eigen::Index>(i)] = robot.joints[i].sign * q[i] + robot.joints[i].offset_rad;
  return theta;
}

double potential_j(const Robot& robot, const Tool& tool, const Eigen::VectorXd& theta,
                   const BearingTilt& tilt) {
  Isometry3d frame = robot.base_fixed;
  double energy = 0.0;
  for (std::size_t i = 0; i < robot.joints.size(); ++i) {
    const Joint& j = robot.joints[i];
    Link link{theta[static_cast<Eigen::Index>(i)], j.d_m, j.a_m, j.alpha_rad, j.beta_rad};
    if (i == tilt.joint) (tilt.axis == 0 ? link.tilt_x : link.tilt_y) = tilt.angle_rad;
    frame = frame * transform(link);
    energy -= j.mass_kg * robot.gravity_m_s2.dot(frame * j.com_m);
  }
  return energy - tool.mass_kg * robot.gravity_m_s2.dot(frame * robot.flange_fixed * tool.com_m);
}

Eigen::VectorXd torque_by_energy_nm(const Robot& robot, const Tool& tool,
                                    const Eigen::VectorXd& theta) {
  constexpr double kStepRad = 1e-4;  // truncation 1e-8 of it, rounding 1e-8 N m
  Eigen::VectorXd torque(theta.size());
  for (Eigen::Index i = 0; i < theta.size(); ++i) {
    Eigen::VectorXd up = theta, down = theta;
    up[i] += kStepRad;
    down[i] -= kStepRad;
    torque[i] = -(potential_j(robot, tool, up) - potential_j(robot, tool, down)) / (2.0 * kStepRad);
  }
  return torque;
}

double moment_by_energy_nm(const Robot& robot, const Tool& tool, const Eigen::VectorXd& theta,
                           std::size_t joint, int axis) {
  constexpr double kStepRad = 1e-4;
  return -(potential_j(robot, tool, theta, {joint, axis, kStepRad}) -
           potential_j(robot, tool, theta, {joint, axis, -kStepRad})) /
         (2.0 * kStepRad);
}

Eigen::Isometry3d naive_tcp(const ArmModel& arm, const JointVector& q, const Eigen::VectorXd& x) {
  const Robot& robot = arm.robot();
  Tool tool = arm.tool();
  const Eigen::VectorXd theta = nominal_theta(robot, q);
  const Eigen::VectorXd torque = torque_by_energy_nm(robot, tool, theta);
  std::vector<Link> links;
  for (std::size_t i = 0; i < robot.joints.size(); ++i) {
    const Joint& j = robot.joints[i];
    links.push_back({theta[static_cast<Eigen::Index>(i)], j.d_m, j.a_m, j.alpha_rad, j.beta_rad});
  }
  double c_t = 0.0;
  for (Eigen::Index p = 0; p < x.size(); ++p) {
    const ArmParameter& parameter = arm.parameters()[static_cast<std::size_t>(p)];
    const auto joint = static_cast<std::size_t>(std::max(parameter.joint, 0));
    const double phase = parameter.harmonic * q[joint] * robot.joints[joint].gear_ratio;
    switch (parameter.kind) {
      case ParameterKind::kTheta: links[joint].theta += x[p]; break;
      case ParameterKind::kD: links[joint].d += x[p]; break;
      case ParameterKind::kA: links[joint].a += x[p]; break;
      case ParameterKind::kAlpha: links[joint].alpha += x[p]; break;
      case ParameterKind::kBeta: links[joint].beta += x[p]; break;
      case ParameterKind::kCompliance: links[joint].theta += x[p] * torque[parameter.joint]; break;
      case ParameterKind::kLoad: {  // moment only, as of a weight-compensated heavy link
        Robot moved = robot;
        Joint& link = moved.joints[static_cast<std::size_t>(parameter.link)];
        constexpr double kMassKg = 1.0;
        link.mass_kg += kMassKg;
        link.com_m *= (link.mass_kg - kMassKg) / link.mass_kg;
        const double with = torque_by_energy_nm(moved, tool, theta)[parameter.joint];
        link.com_m[parameter.axis] += 1.0 / link.mass_kg;
        links[joint].theta +=
            x[p] * (torque_by_energy_nm(moved, tool, theta)[parameter.joint] - with);
        break;
      }
      case ParameterKind::kStiffening:
        links[joint].theta +=
            x[p] * std::tanh(torque[parameter.joint] / robot.joints[joint].stiffening_nm);
        break;
      case ParameterKind::kPlay:
        links[joint].theta +=
            x[p] * std::tanh(torque[parameter.joint] / robot.joints[joint].play_closes_nm);
        break;
      case ParameterKind::kCosine: links[joint].theta += x[p] * std::cos(phase); break;
      case ParameterKind::kSine: links[joint].theta += x[p] * std::sin(phase); break;
      case ParameterKind::kFunctionCosine:
        links[joint].theta += x[p] * std::cos(parameter.harmonic * q[joint]);
        break;
      case ParameterKind::kFunctionSine:
        links[joint].theta += x[p] * std::sin(parameter.harmonic * q[joint]);
        break;
      case ParameterKind::kBearing: {
        const double tilt = x[p] * moment_by_energy_nm(robot, tool, theta, joint, parameter.axis);
        (parameter.axis == 0 ? links[joint].tilt_x : links[joint].tilt_y) += tilt;
        break;
      }
      case ParameterKind::kDeflection: c_t = x[p]; break;
      case ParameterKind::kTcp: tool.tcp.translation()[parameter.axis] += x[p]; break;
      default: break;  // not of the arm
    }
  }
  Isometry3d flange = robot.base_fixed;
  for (const Link& link : links) flange = flange * transform(link);
  flange = flange * robot.flange_fixed;
  // Cantilever: F = m g sin(angle between gravity and the flange's z), along g across z.
  const Vector3d z = flange.linear().col(2), g = robot.gravity_m_s2;
  const double sine = z.cross(g).norm() / g.norm();
  const double force = tool.mass_kg * g.norm() * sine;
  const Vector3d across = (g - g.dot(z) * z).normalized();
  Isometry3d tcp = flange * tool.tcp;
  if (c_t != 0.0 && sine > 1e-12) {
    const double bend = c_t * force * std::pow(tool.length_m, 3) / 3.0;
    const double turn = c_t * force * std::pow(tool.length_m, 2) / 2.0;
    tcp.linear() = AngleAxisd(turn, z.cross(across).normalized()) * tcp.linear();
    tcp.translation() += bend * across;
  }
  return tcp;
}

}  // namespace cellcal::calib::testing
