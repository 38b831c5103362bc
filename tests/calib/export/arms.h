#pragma once
// Calibrations and poses for the tests of the export formats.

#include <random>

#include "calib/export/rigid_arm.h"
#include "calib/files/files.h"
#include "calib/files/robot_file.h"
#include "calib/result/calibration.h"

namespace cellcal::calib::testing {

inline Robot kr5() { return load_robot(CELLCAL_ROBOTS_FOLDER "/kr5_r1400.toml"); }

inline std::vector<double> random_joints(const Robot& robot, std::mt19937& random) {
  std::uniform_real_distribution<double> share(0.0, 1.0);
  std::vector<double> joint_rad;
  for (const Joint& joint : robot.joints)
    joint_rad.push_back(joint.min_rad + share(random) * (joint.max_rad - joint.min_rad));
  return joint_rad;
}

/// A KR 5 with known, realistic geometric errors of all kinds; nothing elastic.
inline Calibration rigid_calibration(unsigned seed) {
  Calibration c;
  c.cell.robot = kr5();
  c.cell.tool.tcp.translation() << 0.06, 0.05, 0.41;
  c.cell.tool.tcp_sigma_m.setConstant(1e-3);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto add = [&](const ParameterKey& key, double value) {
    ParameterResult p;
    p.key = key;
    p.correction = value;
    p.sigma = 1e-5;
    c.parameters.push_back(p);
  };
  for (std::size_t i = 0; i < c.cell.robot.joints.size(); ++i) {
    for (const JointError error : c.cell.robot.joints[i].errors) {
      const bool length = error == JointError::kD || error == JointError::kA;
      const ParameterKind kind = error == JointError::kTheta   ? ParameterKind::kTheta
                                 : error == JointError::kD     ? ParameterKind::kD
                                 : error == JointError::kA     ? ParameterKind::kA
                                 : error == JointError::kAlpha ? ParameterKind::kAlpha
                                                               : ParameterKind::kBeta;
      add(joint_parameter(kind, i), (length ? 7e-4 : 6e-4) * normal(random));
    }
  }
  for (int axis = 0; axis < 3; ++axis)
    add(tool_parameter(ParameterKind::kTcp, 0, axis), 5e-4 * normal(random));
  return c;
}

/// rigid_calibration() in which joints 2 and 3 give.
inline Calibration soft_calibration() {
  Calibration c = rigid_calibration(7);
  for (const std::size_t joint : {1u, 2u}) {
    c.cell.robot.joints[joint].mass_kg = 60.0;
    c.cell.robot.joints[joint].com_m.x() = -0.2;
    ParameterResult give;
    give.key = joint_parameter(ParameterKind::kCompliance, joint);
    give.correction = 2e-6;
    c.parameters.push_back(give);
  }
  return c;
}

inline double apart_m(const Eigen::Isometry3d& one, const Eigen::Isometry3d& other) {
  return (one.translation() - other.translation()).norm();
}
inline double apart_rad(const Eigen::Isometry3d& one, const Eigen::Isometry3d& other) {
  return (one.linear() - other.linear()).norm();
}

}  // namespace cellcal::calib::testing
