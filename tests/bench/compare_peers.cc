// Solvers of the same problem, each in a process of its own: cellcal's identification, and Ceres
// with automatic derivatives of a directly written residual. tests/bench/compare runs them and
// scipy, and compares. The problem: geometric errors of the demo cell's arm, bending of its tool,
// rho and four centres, all with priors; plain squares, no outliers.

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "calib/identify/identify.h"
#include "calib/model/joint_vector.h"
#include "tests/calib/simulate.h"
#include "tests/command_line/command_line.h"

namespace {

using namespace cellcal;         // NOLINT: a benchmark's own file
using namespace cellcal::calib;  // NOLINT
using nlohmann::json;

constexpr ModelLevel kPlain{0.0, 0.0, 0.0};
constexpr int kJoints = 6, kShared = 26, kCentre = 3;  // geometry, bending and rho; a centre

/// Spheres of known diameter, no certified lengths: the terms of the plain residual.
Cell plain_cell() {
  Cell cell = at_level(testing::demo_cell(), kPlain);
  for (Target& target : cell.targets) target.diameter_sigma_m = 0.0;
  cell.lengths.clear();
  return cell;
}

json numbers(const Eigen::Isometry3d& t) {
  json rows = json::array();
  for (int r = 0; r < 4; ++r)
    rows.push_back({t.matrix()(r, 0), t.matrix()(r, 1), t.matrix()(r, 2), t.matrix()(r, 3)});
  return rows;
}

/// The problem in SI, for any solver.
json described(const Cell& cell) {
  const ArmModel arm(cell.robot, cell.tool);
  if (arm.size() + 1 != kShared || arm.joint_count() != kJoints)
    throw std::runtime_error("the demo cell's arm has other errors than this benchmark knows");
  json out;
  for (const Joint& j : cell.robot.joints)
    out["joints"].push_back({j.sign, j.offset_rad, j.d_m, j.a_m, j.alpha_rad, j.beta_rad});
  for (const ArmParameter& p : arm.parameters())
    out["parameters"].push_back({static_cast<int>(p.kind), p.joint, p.sigma});
  out["base"] = numbers(cell.robot.base_fixed);
  out["flange"] = numbers(cell.robot.flange_fixed);
  for (int k = 0; k < 3; ++k) {
    out["gravity"].push_back(cell.robot.gravity_m_s2[k]);
    out["tcp"].push_back(cell.tool.tcp.translation()[k]);
  }
  out["stiff"] = cell.tool.mass_kg * std::pow(cell.tool.length_m, 3) / 3.0;
  out["rho_sigma"] = cell.radius_offset_sigma_m;
  out["touch_sigma"] = cell.touch_sigma_m;
  for (const Target& t : cell.targets)
    out["targets"].push_back({t.centre_m.x(), t.centre_m.y(), t.centre_m.z(), t.centre_sigma_m,
                              t.diameter_m / 2.0 + cell.tool.tip_radius_m});
  return out;
}

/// Joint angles [rad] and the target's index, one touch a line.
void write_problem(const std::string& folder, int count) {
  const Cell cell = plain_cell();
  sim::TruthOptions options;
  options.seed = 1;
  const auto made =
      testing::make_touches(cell, sim::draw_truth(cell, options), {.fit = count, .seed = 1});
  std::ofstream(folder + "/problem.json") << described(cell);
  std::ofstream out(folder + "/touches.txt");
  for (const Touch& touch : made.touches) {
    for (const double q : touch.joint_rad) out << fmt::format("{:.17g} ", q);
    out << cell.target_index(touch.target) << '\n';
  }
  if (!out) throw std::runtime_error("cannot write into " + folder);
}

std::vector<Touch> read_touches(const std::string& folder, const Cell& cell) {
  std::ifstream in(folder + "/touches.txt");
  std::vector<Touch> touches;
  for (JointVector q(kJoints); true;) {
    for (double& angle : q) in >> angle;
    std::size_t target = 0;
    if (!(in >> target)) return touches;
    Touch touch;
    touch.target = cell.targets.at(target).id;
    touch.joint_rad = q;
    touches.push_back(std::move(touch));
  }
}

struct Solution {
  std::vector<double> x;  ///< SI: arm, rho, centres
  int iterations = 0;     ///< 0: not reported
};

Solution by_cellcal(const Cell& cell, const std::vector<Touch>& touches, bool full) {
  IdentifyOptions options;
  if (!full) {
    options.level = kPlain;
    options.reject_outliers = false;
  }
  const Calibration result = identify(cell, touches, options);
  Solution solution;
  for (const ParameterResult& p : result.parameters) solution.x.push_back(p.nominal + p.correction);
  return solution;
}

/// The touch of a sphere, written directly: chain, tool, bending, distance.
struct TouchCost {
  const Cell& cell;
  const std::vector<ArmParameter>& parameters;
  const JointVector& q;
  const Target& target;

  /// A rotation of columns a and b.
  template <typename T>
  static void mix(Eigen::Matrix<T, 3, 3>& turn, int a, int b, const T& angle) {
    const T c = cos(angle), s = sin(angle);
    for (int k = 0; k < 3; ++k) {
      const T first = turn(k, a);
      turn(k, a) = c * first + s * turn(k, b);
      turn(k, b) = c * turn(k, b) - s * first;
    }
  }

  template <typename T>
  bool operator()(const T* u, const T* centre_u, T* residual) const {
    using Matrix = Eigen::Matrix<T, 3, 3>;
    using Vector = Eigen::Matrix<T, 3, 1>;
    T error[kJoints][5] = {};
    T bending(0.0);
    for (int p = 0; p + 1 < kShared; ++p) {
      const T x = u[p] * parameters[p].sigma;
      if (parameters[p].joint < 0)
        bending = x;
      else
        error[parameters[p].joint][static_cast<int>(parameters[p].kind)] = x;
    }
    Matrix turn = cell.robot.base_fixed.linear().cast<T>();
    Vector at = cell.robot.base_fixed.translation().cast<T>();
    for (int i = 0; i < kJoints; ++i) {
      const Joint& joint = cell.robot.joints[i];
      mix<T>(turn, 0, 1, joint.sign * q[i] + joint.offset_rad + error[i][0]);
      at += turn.col(2) * (joint.d_m + error[i][1]) + turn.col(0) * (joint.a_m + error[i][2]);
      mix<T>(turn, 1, 2, joint.alpha_rad + error[i][3]);
      mix<T>(turn, 2, 0, joint.beta_rad + error[i][4]);
    }
    at += turn * cell.robot.flange_fixed.translation().cast<T>();
    turn = turn * cell.robot.flange_fixed.linear().cast<T>();
    const Vector z = turn.col(2), g = cell.robot.gravity_m_s2.cast<T>();
    const double stiff = cell.tool.mass_kg * std::pow(cell.tool.length_m, 3) / 3.0;
    at += turn * cell.tool.tcp.translation().cast<T>() + bending * stiff * (g - z * g.dot(z));
    for (int k = 0; k < kCentre; ++k)
      at[k] -= target.centre_m[k] + centre_u[k] * target.centre_sigma_m;
    const T radius = target.diameter_m / 2.0 + cell.tool.tip_radius_m +
                     u[kShared - 1] * cell.radius_offset_sigma_m;
    residual[0] = (at.norm() - radius) / cell.touch_sigma_m;
    return true;
  }
};

template <int kSize>
struct Prior {
  template <typename T>
  bool operator()(const T* u, T* residual) const {
    std::copy_n(u, kSize, residual);
    return true;
  }
};

Solution by_autodiff(const Cell& cell, const std::vector<Touch>& touches) {
  const ArmModel arm(cell.robot, cell.tool);
  std::vector<double> shared(kShared, 0.0);
  std::vector<std::array<double, kCentre>> centres(cell.targets.size(), {0.0, 0.0, 0.0});
  ceres::Problem problem;
  problem.AddResidualBlock(
      new ceres::AutoDiffCostFunction<Prior<kShared>, kShared, kShared>(new Prior<kShared>),
      nullptr, shared.data());
  for (auto& centre : centres)
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<Prior<kCentre>, kCentre, kCentre>(new Prior<kCentre>),
        nullptr, centre.data());
  for (const Touch& touch : touches) {
    const std::size_t t = cell.target_index(touch.target);
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<TouchCost, 1, kShared, kCentre>(
            new TouchCost{cell, arm.parameters(), touch.joint_rad, cell.targets[t]}),
        nullptr, shared.data(), centres[t].data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.function_tolerance = 1e-12;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  Solution solution;
  for (int p = 0; p < kShared; ++p)
    solution.x.push_back(
        shared[p] * (p + 1 < kShared ? arm.parameters()[p].sigma : cell.radius_offset_sigma_m));
  for (std::size_t t = 0; t < centres.size(); ++t)
    for (int k = 0; k < kCentre; ++k)
      solution.x.push_back(cell.targets[t].centre_m[k] +
                           centres[t][k] * cell.targets[t].centre_sigma_m);
  solution.iterations = static_cast<int>(summary.iterations.size()) - 1;
  return solution;
}

}  // namespace

int main(int argc, char** argv) {
  cellcal::CommandLine app{
      "Writes the common problem, or solves it and prints times and solution as JSON."};
  std::string what, folder;
  int count = 100, runs = 1;
  app.option("what", what).required().one_of({"write", "cellcal", "cellcal-full", "autodiff"});
  app.option("folder", folder).required().folder();
  app.option("--touches", count, "To write").between(20, 1000000);
  app.option("--runs", runs).between(1, 10000);
  if (const auto code = app.parse(argc, argv)) return *code;
  try {
    if (what == "write") {
      write_problem(folder, count);
      return 0;
    }
    const Cell cell = plain_cell();
    const std::vector<Touch> touches = read_touches(folder, cell);
    json out;
    for (int run = 0; run < runs; ++run) {
      const auto start = std::chrono::steady_clock::now();
      const Solution solution = what == "autodiff"
                                    ? by_autodiff(cell, touches)
                                    : by_cellcal(cell, touches, what == "cellcal-full");
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
      out["seconds"].push_back(took.count());
      out["x"] = solution.x;
      out["iterations"] = solution.iterations;
    }
    fmt::print("{}\n", out.dump());
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
