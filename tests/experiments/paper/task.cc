#include "tests/experiments/paper/task.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "calib/files/files.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"

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
    case calib::ParameterKind::kTheta: return errors.theta_rad;
    case calib::ParameterKind::kD: return errors.d_m;
    case calib::ParameterKind::kA: return errors.a_m;
    case calib::ParameterKind::kAlpha: return errors.alpha_rad;
    case calib::ParameterKind::kBeta: return errors.beta_rad;
    default: return 0.0;
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

namespace {

constexpr int kStarts = 12;
constexpr int kSteps = 40;
constexpr double kLargestStep = 0.4;      // rad; keeps Newton's method on its initial branch
constexpr double kNominalAgrees = 1e-7;   // m and rad: reach_exactly refines it
constexpr double kExactlyAgrees = 1e-13;  // m; rounding of doubles at 2 m is about 4e-16
constexpr double kLimitMargin = 0.02;     // rad, so that small errors stay inside

using Angles = std::vector<double>;

/// Into (-pi, pi], the range of every revolute axis of the arms used here.
double wrapped(double angle) { return std::remainder(angle, 2.0 * std::numbers::pi); }

bool inside_limits(const calib::Robot& robot, const Angles& joint_rad, double margin) {
  for (std::size_t i = 0; i < joint_rad.size(); ++i)
    if (joint_rad[i] < robot.joints[i].min_rad + margin ||
        joint_rad[i] > robot.joints[i].max_rad - margin)
      return false;
  return true;
}

Angles random_start(const calib::Robot& robot, std::mt19937_64& random) {
  Angles start;
  for (const calib::Joint& joint : robot.joints) {
    const double low = std::max(joint.min_rad, -std::numbers::pi);
    const double high = std::min(joint.max_rad, std::numbers::pi);
    start.push_back(std::uniform_real_distribution<double>(low, high)(random));
  }
  return start;
}

void add(Angles& joint_rad, Eigen::VectorXd step) {
  if (const double largest = step.cwiseAbs().maxCoeff(); largest > kLargestStep)
    step *= kLargestStep / largest;
  for (std::size_t i = 0; i < joint_rad.size(); ++i)
    joint_rad[i] += step[static_cast<Eigen::Index>(i)];
}

}  // namespace

std::optional<Angles> reach_nominal(const calib::ArmModel& model, const Eigen::Matrix3d& flange,
                                    const Eigen::Vector3d& tip_m, std::mt19937_64& random) {
  const Eigen::Matrix3d tool = flange * model.tool().tcp.linear();
  for (int start = 0; start < kStarts; ++start) {
    Angles joint_rad = random_start(model.robot(), random);
    for (int step = 0; step < kSteps; ++step) {
      const Eigen::Isometry3d tcp = model.nominal_tcp(joint_rad);
      const Eigen::AngleAxisd turn(tool * tcp.linear().transpose());
      Eigen::Matrix<double, 6, 1> error;
      error << tip_m - tcp.translation(), turn.angle() * turn.axis();
      if (error.norm() < kNominalAgrees) {
        for (double& angle : joint_rad) angle = wrapped(angle);
        if (inside_limits(model.robot(), joint_rad, kLimitMargin)) return joint_rad;
        break;
      }
      add(joint_rad,
          model.nominal_jacobian(joint_rad).completeOrthogonalDecomposition().solve(error));
    }
  }
  return std::nullopt;
}

std::optional<Angles> reach_exactly(const calib::ArmModel& model, const double* x,
                                    const Eigen::Vector3d& tip_m, Angles joint_rad) {
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::Vector3d error = tip_m - model.position(model.prepare(joint_rad), x);
    if (error.norm() < kExactlyAgrees)
      return inside_limits(model.robot(), joint_rad, 0.0) ? std::optional(joint_rad) : std::nullopt;
    const Eigen::Matrix3Xd jacobian = model.nominal_jacobian(joint_rad).topRows<3>();
    add(joint_rad, jacobian.completeOrthogonalDecomposition().solve(error));
  }
  return std::nullopt;
}

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
  const Eigen::Isometry3d align = calib::rigid_motion(predicted, real);
  Spread spread;
  int count = 0;
  for (int i = 0; i < poses; ++i)
    add(spread, (align * predicted.col(i) - real.col(i)).norm(), count);
  spread.mean_m /= count;
  return spread;
}

}  // namespace cellcal::sim::paper
