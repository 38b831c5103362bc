#include "sim/experiments/paper/accuracy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

namespace cellcal::sim::paper {

namespace {

constexpr unsigned kWorkspaceSeed = 20241028;  // arbitrary; the same poses for every result

void add(Spread& spread, double error, int& count) {
  spread.mean_m += error;
  spread.max_m = std::max(spread.max_m, error);
  ++count;
}

std::vector<double> random_pose(const calib::Robot& robot, std::mt19937_64& random) {
  std::vector<double> pose;
  for (const calib::Joint& joint : robot.joints)
    pose.push_back(
        std::uniform_real_distribution<double>(std::max(joint.min_rad, -std::numbers::pi),
                                               std::min(joint.max_rad, std::numbers::pi))(random));
  return pose;
}

}  // namespace

Eigen::VectorXd arm_errors(const calib::ArmModel& model, const calib::Calibration& result) {
  Eigen::VectorXd x(model.size());
  for (int p = 0; p < model.size(); ++p) {
    const calib::ParameterKey& key = model.parameters()[p];
    const calib::ParameterResult* found = find(result, key);
    if (found == nullptr)
      throw std::runtime_error("the result lacks parameter " + parameter_name(result.cell, key));
    x[p] = found->correction;
  }
  return x;
}

Spread check_on_exact_chain(const Task& task, const calib::Calibration& result) {
  const calib::ArmModel model(task.cell.robot, task.cell.tool);
  const Eigen::VectorXd x = arm_errors(model, result);
  Spread spread;
  int count = 0;
  for (const calib::Touch& touch : task.touches) {
    if (touch.set != calib::TouchSet::kCheck) continue;
    const Eigen::Vector3d tip = model.position(model.prepare(touch.joint_rad), x.data());
    const calib::TargetResult& target = result.targets.at(0);
    add(spread, std::abs((tip - target.centre_m).norm() - target.effective_radius_m), count);
  }
  if (count > 0) spread.mean_m /= count;
  return spread;
}

Spread nominal_error(const Task& task, calib::TouchSet set) {
  const calib::ArmModel model(task.cell.robot, task.cell.tool);
  Spread spread;
  int count = 0;
  for (const calib::Touch& touch : task.touches) {
    if (touch.set != set) continue;
    const Eigen::Vector3d tip = model.nominal_tcp(touch.joint_rad).translation();
    add(spread, std::abs((tip - task.centre_m).norm() - task.radius_m), count);
  }
  if (count > 0) spread.mean_m /= count;
  return spread;
}

Spread workspace_error(const Task& task, const calib::Calibration& result, int poses) {
  const calib::ArmModel model(task.cell.robot, task.cell.tool);
  const Eigen::VectorXd x = arm_errors(model, result);
  std::mt19937_64 random(kWorkspaceSeed);
  Eigen::Matrix3Xd predicted(3, poses), real(3, poses);
  for (int i = 0; i < poses; ++i) {
    const calib::PreparedPose pose = model.prepare(random_pose(model.robot(), random));
    predicted.col(i) = model.position(pose, x.data());
    real.col(i) = model.position(pose, task.true_errors.data());
  }
  const Eigen::Isometry3d align(Eigen::umeyama(predicted, real, false));
  Spread spread;
  int count = 0;
  for (int i = 0; i < poses; ++i)
    add(spread, (align * predicted.col(i) - real.col(i)).norm(), count);
  spread.mean_m /= count;
  return spread;
}

}  // namespace cellcal::sim::paper
