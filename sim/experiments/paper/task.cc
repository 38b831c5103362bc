#include "sim/experiments/paper/task.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <stdexcept>

#include "calib/estimate/problem.h"
#include "calib/estimate/solve.h"
#include "calib/estimate/start.h"
#include "calib/files/files.h"
#include "calib/identify/identify.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "calib/seed_paper/paper.h"
#include "sim/experiments/paper/table.h"

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

constexpr int kMostIterations = 50;  // as in the paper's figure
constexpr double kSame = 1e-16;      // m; converged

double mean_residual_m(const calib::Problem& problem, const Eigen::VectorXd& u,
                       const std::vector<bool>& use) {
  const Eigen::VectorXd x = problem.to_si(u);
  const calib::Problem::At at = problem.at(x.data());
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < problem.touches().size(); ++i) {
    if (!use[i]) continue;
    double residual = 0.0;
    problem.residual_m(i, at, &residual, nullptr, nullptr);
    sum += std::abs(residual);
    ++count;
  }
  return sum / count;
}

/// Mean residual of the fit with the solver stopped after 0, 1, 2... iterations. The estimator does
/// not record its steps, and a fit takes milliseconds, so it is rerun for each.
std::vector<double> convergence(const Task& task) {
  const calib::ArmModel arm(task.cell.robot, task.cell.tool);
  std::vector<bool> use;
  std::vector<Eigen::Vector3d> nominal;
  for (const calib::Touch& touch : task.touches) {
    use.push_back(touch.set == calib::TouchSet::kFit);
    if (use.back()) nominal.push_back(arm.nominal_tcp(touch.joint_rad).translation());
  }
  const calib::SphereFit start =
      calib::fit_centre(nominal, std::vector<double>(nominal.size(), task.radius_m));
  const calib::Problem problem(task.cell, arm, task.touches, {start.centre_m});
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(problem.size());
  std::vector<double> mean_m{mean_residual_m(problem, zero, use)};
  for (int iterations = 1; iterations <= kMostIterations; ++iterations) {
    const calib::SolveResult solved = calib::solve(problem, zero, {use, 0.0, iterations});
    mean_m.push_back(mean_residual_m(problem, solved.u, use));
    if (solved.converged || std::abs(mean_m[iterations] - mean_m[iterations - 1]) < kSame) break;
  }
  return mean_m;
}

void add_workspace_errors(Conditions conditions, unsigned seed, std::vector<double>& paper,
                          std::vector<double>& ours) {
  conditions.seed = seed;
  const Task task = make_task(conditions);
  paper.push_back(workspace_error(task, calib::identify_paper(task.cell, task.touches)).mean_m);
  ours.push_back(workspace_error(task, calib::identify(task.cell, task.touches)).mean_m);
}

}  // namespace

Solved solve(const Task& task) {
  Solved solved;
  solved.task = task;
  calib::PaperTrace trace;
  solved.paper = calib::identify_paper(task.cell, task.touches, {}, &trace);
  for (const auto& iteration : trace.iterations) solved.paper_mean_m.push_back(iteration.mean_m);
  solved.ours = calib::identify(task.cell, task.touches);
  solved.ours_mean_m = convergence(task);
  return solved;
}

Placings solve_placings(int count) {
  if (count < 1) throw std::invalid_argument("solve_placings: count must be at least 1");
  std::vector<double> simulation_paper, simulation_ours, experiment_paper, experiment_ours;
  for (int i = 1; i <= count; ++i) {
    const auto seed = static_cast<unsigned>(i);
    add_workspace_errors(simulation_conditions(), seed, simulation_paper, simulation_ours);
    add_workspace_errors(experiment_conditions(), seed, experiment_paper, experiment_ours);
  }
  return {count, calib::median_between(simulation_paper), calib::median_between(simulation_ours),
          calib::median_between(experiment_paper), calib::median_between(experiment_ours)};
}

}  // namespace cellcal::sim::paper
