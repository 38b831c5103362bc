#include "sim/experiments/paper/solve.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "calib/estimate/problem.h"
#include "calib/estimate/solve.h"
#include "calib/estimate/start.h"
#include "calib/identify/identify.h"
#include "calib/model/linear.h"
#include "calib/seed_paper/paper.h"
#include "sim/experiments/paper/accuracy.h"

namespace cellcal::sim::paper {

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
