// How long an identification takes, and where the time goes. One cell of four spheres; every run
// identifies another random arm. Prints figures; gates nothing.

#include <fmt/format.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <Eigen/Cholesky>
#include <algorithm>
#include <chrono>

#include "calib/identify/evidence.h"
#include "calib/identify/identify.h"
#include "calib/identify/problem.h"
#include "calib/identify/region.h"
#include "calib/identify/solve.h"
#include "tests/calib/identify/simulate.h"

namespace {

using namespace cellcal;         // NOLINT: a benchmark's own file
using namespace cellcal::calib;  // NOLINT

class Times {
 public:
  template <typename Work>
  void measure(const Work& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    ms_.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
            .count());
  }
  double median() {
    std::sort(ms_.begin(), ms_.end());
    return ms_[ms_.size() / 2];
  }
  double worst() const { return *std::max_element(ms_.begin(), ms_.end()); }

 private:
  std::vector<double> ms_;
};

/// The parts of one identification, each on its own, at the level that was chosen.
struct Parts {
  Times solve, covariance, evidence, predicted;
};

void measure_parts(const Cell& cell, const std::vector<Touch>& touches, const Calibration& result,
                   Parts& parts) {
  const Cell levelled = at_level(cell, result.level);
  const ArmModel arm(levelled.robot, levelled.tool);
  std::vector<Eigen::Vector3d> centres;
  for (const TargetResult& target : result.targets) centres.push_back(target.centre_m);
  const Problem problem(levelled, arm, touches, centres, result.level.ripple_rad);
  const std::vector<bool> use(touches.size(), true);
  const int n = problem.size();
  Eigen::VectorXd u;
  parts.solve.measure([&] {  // from zero errors, coarse and then exact
    u = solve(problem, Eigen::VectorXd::Zero(n), {use, 0.0, 100, 1e-3}).u;
    u = solve(problem, u, {use, 0.0, 100, 0.0}).u;
  });
  Eigen::MatrixXd covariance;
  parts.covariance.measure([&] {
    const Linearisation linear = linearise(problem, u, use);
    Eigen::MatrixXd information = linear.jacobian.transpose() * linear.jacobian;
    for (int i = 0; i < n; ++i)
      information(i, i) += std::pow(problem.unknowns()[i].prior_weight, 2);
    covariance = information.llt().solve(Eigen::MatrixXd::Identity(n, n));
  });
  parts.evidence.measure([&] { (void)weigh_levels(problem, u, use); });
  parts.predicted.measure([&] {
    constexpr int kPoses = 300;
    Eigen::VectorXd scale(arm.size());
    for (int i = 0; i < arm.size(); ++i) scale[i] = problem.unknowns()[i].scale;
    const Eigen::VectorXd x = problem.to_si(u);
    const Eigen::MatrixXd moves =
        aligned_moves(arm, workspace_poses(arm, kPoses, 1), x.data(), scale);
    (void)predicted_mean_error_m(moves, covariance.topLeftCorner(arm.size(), arm.size()));
  });
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Times identify(): median and worst, split into its parts, and peak memory."};
  std::vector<int> counts = {50, 100, 200, 400};
  int runs = 30;
  app.add_option("--touches", counts, "Numbers of fit touches")
      ->delimiter(',')
      ->check(CLI::Range(20, 100000));
  app.add_option("--runs", runs, "Random arms per number")->check(CLI::Range(1, 10000));
  CLI11_PARSE(app, argc, argv);

  fmt::print(
      "touches unknowns   identify median   worst |   solve  covariance  evidence  predicted "
      "(ms)\n");
  const Cell& cell = testing::demo_cell();
  for (const int count : counts) {
    Times whole;
    Parts parts;
    std::size_t unknowns = 0;
    for (int run = 0; run < runs; ++run) {
      const auto seed = static_cast<unsigned>(run + 1);
      sim::TruthOptions options;
      options.seed = seed;
      options.gear_arcsec = 10.0;
      const auto made =
          testing::make_touches(cell, sim::draw_truth(cell, options), {.fit = count, .seed = seed});
      Calibration result;
      whole.measure([&] { result = identify(cell, made.touches); });
      unknowns = std::max(unknowns, result.parameters.size());
      measure_parts(cell, made.touches, result, parts);
    }
    fmt::print("{:7d} {:8d} {:17.1f} {:7.1f} | {:7.1f} {:11.2f} {:9.2f} {:10.2f}\n", count,
               unknowns, whole.median(), whole.worst(), parts.solve.median(),
               parts.covariance.median(), parts.evidence.median(), parts.predicted.median());
  }
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  fmt::print("peak memory {:.1f} MB\n", static_cast<double>(usage.ru_maxrss) / 1024.0);
  return 0;
}
