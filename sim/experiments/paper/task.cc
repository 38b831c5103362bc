#include "sim/experiments/paper/task.h"

#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <stdexcept>

#include "calib/files/files.h"
#include "calib/model/units.h"
#include "sim/experiments/paper/reach.h"

namespace cellcal::sim::paper {

namespace {

using Eigen::Vector3d;

constexpr double kDeg = calib::kRadPerDeg;
constexpr double kMm = 1e-3;

// The tool comes from outside the sphere: maximum angle of its shaft to the surface normal, so that
// neither tool nor arm intersects the sphere.
constexpr double kLargestLean = 60.0 * kDeg;
// Attempts per touch; most directions that fail are on the far side, out of reach.
constexpr int kTries = 2000;

double error_of(const JointErrors& errors, calib::ParameterKind kind) {
  switch (kind) {
    case calib::ParameterKind::kTheta:
      return errors.theta_rad;
    case calib::ParameterKind::kD:
      return errors.d_m;
    case calib::ParameterKind::kA:
      return errors.a_m;
    case calib::ParameterKind::kAlpha:
      return errors.alpha_rad;
    case calib::ParameterKind::kBeta:
      return errors.beta_rad;
    default:
      return 0.0;
  }
}

Eigen::VectorXd true_errors(const calib::ArmModel& model, const Conditions& conditions) {
  if (conditions.errors.size() != model.robot().joints.size())
    throw std::runtime_error("the conditions state the errors of " +
                             std::to_string(conditions.errors.size()) + " joints, the robot has " +
                             std::to_string(model.robot().joints.size()));
  Eigen::VectorXd x = Eigen::VectorXd::Zero(model.size());
  for (int p = 0; p < model.size(); ++p) {
    const calib::ArmParameter& parameter = model.parameters()[p];
    if (parameter.joint >= 0)
      x[p] = error_of(conditions.errors[parameter.joint], parameter.kind);
    else if (parameter.kind == calib::ParameterKind::kDeflection)
      x[p] = conditions.deflection;
  }
  return x;
}

Vector3d random_direction(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Vector3d v;
  do v = {normal(random), normal(random), normal(random)};
  while (v.norm() < 1e-3);
  return v.normalized();
}

/// A flange orientation with the z axis along the shaft towards the sphere.
Eigen::Matrix3d random_flange(const Vector3d& normal, std::mt19937_64& random) {
  Vector3d shaft;
  do shaft = random_direction(random);
  while (shaft.dot(normal) < std::cos(kLargestLean));
  const double roll = std::uniform_real_distribution<double>(0.0, 2.0 * std::numbers::pi)(random);
  return Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), -shaft).toRotationMatrix() *
         Eigen::AngleAxisd(roll, Vector3d::UnitZ()).toRotationMatrix();
}

}  // namespace

Conditions simulation_conditions() {
  Conditions conditions;
  conditions.cell = "simulation.toml";
  conditions.errors = {{0.001, 0.001, -0.001, 0.001, 0.0}, {0.002, 0.0, 0.001, -0.001, 0.001},
                       {0.002, 0.001, -0.001, 0.001, 0.0}, {0.001, -0.001, 0.001, -0.001, 0.0},
                       {0.002, 0.001, -0.001, 0.001, 0.0}, {0.001, -0.001, 0.001, -0.001, 0.0}};
  conditions.deflection = 0.002;
  return conditions;
}

Conditions experiment_conditions() {
  Conditions conditions;
  conditions.cell = "experiment.toml";
  conditions.errors = {{0.021 * kDeg, 0.816 * kMm, -0.231 * kMm, -0.055 * kDeg, 0.0},
                       {-0.019 * kDeg, 0.0, -0.919 * kMm, -0.035 * kDeg, -0.009 * kDeg},
                       {0.037 * kDeg, -0.280 * kMm, 1.551 * kMm, -0.013 * kDeg, 0.0},
                       {0.031 * kDeg, -0.413 * kMm, 1.234 * kMm, 0.029 * kDeg, 0.0},
                       {-0.014 * kDeg, -0.001 * kMm, 0.001 * kMm, 0.052 * kDeg, 0.0},
                       {-0.020 * kDeg, 0.685 * kMm, -0.245 * kMm, 0.038 * kDeg, 0.0}};
  conditions.deflection = 0.00036;
  conditions.noise_m = 0.03 * kMm;
  return conditions;
}

Vector3d sphere_centre() { return {1.340, 0.240, 0.350}; }

Task make_task(const Conditions& conditions) {
  Task task;
  task.cell = calib::load_cell(std::filesystem::path(CELLCAL_PAPER_CELLS) / conditions.cell);
  const calib::Target& sphere = task.cell.targets.at(0);
  task.centre_m = sphere_centre();
  task.radius_m = sphere.diameter_m / 2.0 + task.cell.tool.tip_radius_m;

  const calib::ArmModel model(task.cell.robot, task.cell.tool);
  task.true_errors = true_errors(model, conditions);
  std::mt19937_64 random(conditions.seed);
  std::normal_distribution<double> noise(0.0, 1.0);

  const int count = conditions.fit_touches + conditions.check_touches;
  int tries = 0;
  while (static_cast<int>(task.touches.size()) < count) {
    if (++tries > kTries * count)
      throw std::runtime_error("only " + std::to_string(task.touches.size()) + " of " +
                               std::to_string(count) + " touches of the sphere are in reach");
    const Vector3d normal = random_direction(random);
    const double depth = conditions.noise_m > 0.0 ? conditions.noise_m * noise(random) : 0.0;
    const Vector3d tip = task.centre_m + (task.radius_m + depth) * normal;
    auto joints = reach_nominal(model, random_flange(normal, random), tip, random);
    if (joints) joints = reach_exactly(model, task.true_errors.data(), tip, *joints);
    if (!joints) continue;
    calib::Touch touch;
    touch.joint_rad = *joints;
    touch.target = sphere.id;
    touch.set = static_cast<int>(task.touches.size()) < conditions.fit_touches
                    ? calib::TouchSet::kFit
                    : calib::TouchSet::kCheck;
    task.touches.push_back(touch);
    task.tip_m.push_back(tip);
  }
  return task;
}

}  // namespace cellcal::sim::paper
