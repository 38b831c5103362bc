#include "tests/calib/model/random_arm.h"

#include <numbers>
#include <string>

namespace cellcal::calib::testing {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kRadPerArcsec = kPi / 180.0 / 3600.0;

Joint random_joint(Random& random, int number) {
  Joint joint;
  joint.name = "J" + std::to_string(number);
  joint.sign = random.uniform() < 0.5 ? -1 : 1;
  joint.offset_rad = random.uniform(-kPi, kPi);
  joint.d_m = random.uniform(-0.6, 0.6);
  joint.a_m = random.uniform(-0.6, 0.6);
  joint.alpha_rad = random.uniform(-kPi, kPi);
  joint.beta_rad = random.uniform() < 0.5 ? 0.0 : random.uniform(-1.0, 1.0);
  joint.errors = {JointError::kTheta, JointError::kD, JointError::kA, JointError::kAlpha,
                  JointError::kBeta};
  if (random.uniform() < 0.3) joint.errors.erase(joint.errors.begin() + random.below(5));
  joint.min_rad = -3.0;
  joint.max_rad = 3.0;
  joint.max_speed_rad_s = 2.0;
  joint.tolerance_length_m = 1e-3;
  joint.tolerance_angle_rad = 1e-3;
  joint.mass_kg = random.uniform(0.0, 30.0);
  for (int k = 0; k < 3; ++k) joint.com_m[k] = random.uniform(-0.3, 0.3);
  if (random.uniform() < 0.6) joint.compliance_sigma_rad_per_nm = 1e-6;
  if (joint.mass_kg > 10.0) {
    joint.play_sigma_rad = 30.0 * kRadPerArcsec;
    joint.play_closes_nm = joint.mass_kg;
  }
  if (random.uniform() < 0.5) joint.moment_sigma_kg_m = 2.0;
  if (random.uniform() < 0.6) {
    joint.gear_ratio = random.uniform(-120.0, 120.0);
    joint.harmonics = {1, 2 + static_cast<int>(random.below(4))};
    joint.harmonic_sigma_rad = 20.0 * kRadPerArcsec;
  }
  if (joint.mass_kg < 6.0) joint.bearing_sigma_rad_per_nm = 1e-6;
  if (joint.mass_kg > 10.0 && joint.mass_kg < 20.0) {
    joint.stiffening_sigma_rad = 60.0 * kRadPerArcsec;
    joint.stiffening_nm = 3.0 * joint.mass_kg;
    joint.counterbalance_sigma_rad = 300.0 * kRadPerArcsec;
  }
  if (joint.mass_kg > 24.0) {
    joint.function_sigma_rad = 20.0 * kRadPerArcsec;
    joint.function_reach_rad = 0.1;
    if (joint.mass_kg > 27.0) joint.function_fast_sigma_rad = 5.0 * kRadPerArcsec;
  }
  if (joint.mass_kg > 18.0 && joint.mass_kg < 28.0)
    joint.waves = {{17, 20.0 * kRadPerArcsec}, {143, 8.0 * kRadPerArcsec}};
  return joint;
}

Tool random_tool(Random& random) {
  Tool tool;
  tool.tcp = random_pose(random, 0.3);
  for (int k = 0; k < 3; ++k) tool.tcp_sigma_m[k] = random.uniform() < 0.7 ? 5e-4 : 0.0;
  tool.mass_kg = random.uniform(0.5, 10.0);
  for (int k = 0; k < 3; ++k) tool.com_m[k] = random.uniform(-0.2, 0.2);
  tool.length_m = random.uniform(0.1, 0.6);
  tool.deflection_sigma = random.uniform() < 0.8 ? 0.003 : 0.0;
  return tool;
}

}  // namespace

Eigen::Vector3d random_direction(Random& random) {
  Eigen::Vector3d v;
  do {
    for (int k = 0; k < 3; ++k) v[k] = random.normal();
  } while (v.norm() < 1e-3);
  return v.normalized();
}

Eigen::Isometry3d random_pose(Random& random, double reach_m) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() =
      Eigen::AngleAxisd(random.uniform(-kPi, kPi), random_direction(random)).toRotationMatrix();
  for (int k = 0; k < 3; ++k) pose.translation()[k] = random.uniform(-reach_m, reach_m);
  return pose;
}

RandomArm random_arm(Random& random) {
  RandomArm arm;
  const int joints = 3 + static_cast<int>(random.below(7));
  for (int i = 0; i < joints; ++i) arm.robot.joints.push_back(random_joint(random, i + 1));
  arm.robot.name = "random";
  arm.robot.gravity_m_s2 = 9.81 * random_direction(random);
  arm.robot.base_fixed = random_pose(random, 0.5);
  arm.robot.flange_fixed = random_pose(random, 0.2);
  arm.tool = random_tool(random);
  return arm;
}

RandomArm random_six_axis_arm(Random& random) {
  RandomArm arm = random_arm(random);
  arm.robot.joints.resize(6, random_joint(random, 0));
  // Upper arm and forearm of similar length, intersecting wrist axes: the usual design.
  constexpr double kAlpha[] = {-kPi / 2, 0.0, -kPi / 2, kPi / 2, -kPi / 2, 0.0};
  const double a[] = {
      random.uniform(0.0, 0.3), random.uniform(0.4, 0.8), random.uniform(0.0, 0.1), 0.0, 0.0, 0.0};
  const double d[] = {random.uniform(0.2, 0.6), 0.0, 0.0,
                      random.uniform(0.4, 0.8), 0.0, random.uniform(0.05, 0.2)};
  for (std::size_t i = 0; i < arm.robot.joints.size(); ++i) {
    Joint& joint = arm.robot.joints[i];
    joint.name = "J" + std::to_string(i + 1);
    joint.alpha_rad = kAlpha[i];
    joint.beta_rad = 0.0;
    joint.a_m = a[i];
    joint.d_m = d[i];
  }
  return arm;
}

JointVector random_joints(const Robot& robot, Random& random) {
  JointVector q;
  for (const Joint& joint : robot.joints) q.push_back(random.uniform(joint.min_rad, joint.max_rad));
  return q;
}

Eigen::VectorXd random_errors(const ArmModel& arm, Random& random, double sigmas) {
  Eigen::VectorXd x(arm.size());
  for (int i = 0; i < arm.size(); ++i)
    x[i] = sigmas * arm.parameters()[static_cast<std::size_t>(i)].sigma * random.normal();
  return x;
}

}  // namespace cellcal::calib::testing
