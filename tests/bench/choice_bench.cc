// Time of the choice of touches on one core: 400 out of eight spheres with 500 candidates each,
// compared with a greedy choice that recomputes the posterior for every pick.

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <vector>

#include "calib/files/files.h"
#include "calib/model/linear.h"
#include "calib/plan/choose.h"
#include "calib/plan/design.h"
#include "calib/plan/pool.h"
#include "tests/bench/times.h"
#include "tests/command_line/command_line.h"

namespace {

using namespace cellcal::calib;  // NOLINT: a benchmark's own file

constexpr int kExchanges = 6;  // as in plans

/// CPU time, so that other load on the machine does not count.
double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  constexpr double kNano = 1e-9;
  return static_cast<double>(now.tv_sec) + kNano * static_cast<double>(now.tv_nsec);
}

/// The demo cell's arm and tool with spheres all around its front; a different cell for each seed.
Cell cell_of(const Cell& demo, int spheres, unsigned seed) {
  Cell cell = demo;
  Random random(seed);
  const Target like = demo.targets.front();
  cell.targets.clear();
  cell.lengths.clear();
  for (int k = 0; k < spheres; ++k) {
    Target target = like;
    target.id = fmt::format("S{}", k + 1);
    const double angle = 1.9 * ((k + 0.5) / spheres - 0.5) + random.uniform(-0.05, 0.05);
    const double off = random.uniform(0.85, 1.15);
    target.centre_m = {off * std::cos(angle), off * std::sin(angle), random.uniform(0.2, 0.8)};
    cell.targets.push_back(target);
  }
  constexpr double kCertifiedSigmaM = 5e-6;
  for (std::size_t k = 1; k < cell.targets.size(); ++k)
    cell.lengths.push_back({cell.targets[k - 1].id, cell.targets[k].id,
                            (cell.targets[k - 1].centre_m - cell.targets[k].centre_m).norm(),
                            kCertifiedSigmaM});
  return cell;
}

/// At most this many candidates of each sphere.
std::vector<Candidate> candidates_of(const Cell& cell, const ArmModel& arm, int per_sphere) {
  PlanOptions options;
  std::vector<Candidate> all =
      find_candidates(cell, arm, Clearance::blind(), options, 2 * per_sphere);
  std::vector<int> have(cell.targets.size(), 0);
  std::erase_if(all, [&](const Candidate& c) { return ++have[c.target] > per_sphere; });
  return all;
}

/// The greedy choice without values kept between picks. Fills the seconds of each pick.
std::vector<std::size_t> naive(const DesignProblem& problem, int picks, std::vector<double>& took) {
  const RowMajor& rows = problem.rows;
  const Eigen::Index n = rows.cols(), arm = problem.moves_m.cols();
  Eigen::MatrixXd information = problem.covariance_u.llt().solve(Eigen::MatrixXd::Identity(n, n));
  const Eigen::MatrixXd weight = problem.moves_m.transpose() * problem.moves_m;
  std::vector<std::size_t> picked;
  for (int k = 0; k < picks; ++k) {
    const double start = cpu_seconds();
    const Eigen::MatrixXd covariance = information.llt().solve(Eigen::MatrixXd::Identity(n, n));
    const Eigen::MatrixXd through = covariance * rows.transpose();
    const Eigen::MatrixXd weighed = weight * through.topRows(arm);
    double best = -1.0;
    Eigen::Index pick = 0;
    for (Eigen::Index c = 0; c < rows.rows(); ++c) {
      if (std::find(picked.begin(), picked.end(), static_cast<std::size_t>(c)) != picked.end())
        continue;
      const double gain =
          through.col(c).head(arm).dot(weighed.col(c)) / (1.0 + rows.row(c).dot(through.col(c)));
      if (gain > best) {
        best = gain;
        pick = c;
      }
    }
    picked.push_back(static_cast<std::size_t>(pick));
    information += rows.row(pick).transpose() * rows.row(pick);
    took.push_back(cpu_seconds() - start);
  }
  return picked;
}

}  // namespace

int main(int argc, char** argv) {
  cellcal::CommandLine app{"Times the choice of touches, seconds of the processor."};
  int cells = 10, spheres = 8, per_sphere = 500, picks = 400, baseline_picks = 20;
  app.option("--cells", cells, "Another cell each").between(1, 10000);
  app.option("--spheres", spheres, "In a cell").between(1, 100);
  app.option("--candidates", per_sphere, "Of a sphere").between(10, 100000);
  app.option("--picks", picks, "Touches to choose").between(1, 100000);
  app.option("--baseline-picks", baseline_picks,
             "Picks of the baseline that are timed; each takes the same time")
      .between(1, 100000);
  if (const auto code = app.parse(argc, argv)) return *code;
  const Cell demo = load_cell(CELLCAL_DEMO_CELL);
  cellcal::bench::Times whole, greedy, baseline;
  std::size_t candidates = 0;
  Eigen::Index unknowns = 0;
  int same = 0, compared = 0;
  for (int k = 0; k < cells; ++k) {
    const Cell cell = cell_of(demo, spheres, 1 + static_cast<unsigned>(k));
    const ArmModel arm = planning_arm(cell);
    const std::vector<Candidate> list = candidates_of(cell, arm, per_sphere);
    candidates = list.size();
    ChooseOptions options;
    options.count = picks;
    options.least_per_target = std::max(5, picks / (2 * spheres));
    options.exchanges = kExchanges;
    double start = cpu_seconds();
    if (static_cast<int>(choose(cell, list, options).picked.size()) != picks) return 1;
    whole.add(1e6 * (cpu_seconds() - start));
    options.exchanges = 0;
    start = cpu_seconds();
    (void)choose(cell, list, options);
    greedy.add(1e6 * (cpu_seconds() - start));
    // The baseline has no minimum per sphere; for the comparison the choice has none either.
    const DesignProblem problem = design_problem(cell, list, options.region);
    unknowns = problem.rows.cols();
    std::vector<double> took;
    const auto slow = naive(problem, std::min(baseline_picks, picks), took);
    for (const double s : took) baseline.add(s * 1e6);
    options.least_per_target = 0;
    options.count = static_cast<int>(slow.size());
    const auto fast = choose(cell, list, options).picked;
    for (std::size_t i = 0; i < slow.size(); ++i) same += slow[i] == fast[i];
    compared += static_cast<int>(slow.size());
  }
  const double pick_s = baseline.quantile(0.5) / 1e6;
  const double naive_s = pick_s * picks;
  fmt::print("{} of {} candidates, {} unknowns, {} cells, one core\n", picks, candidates, unknowns,
             cells);
  fmt::print("{:44s} median {:7.3f} s   worst {:7.3f} s\n", "greedy, then exchanges",
             whole.quantile(0.5) / 1e6, whole.worst() / 1e6);
  fmt::print("{:44s} median {:7.3f} s   worst {:7.3f} s\n", "greedy alone",
             greedy.quantile(0.5) / 1e6, greedy.worst() / 1e6);
  fmt::print("{:44s} median {:7.3f} s a pick, {:.1f} s for {} picks: {:.0f} times as long\n",
             "greedy, the posterior worked out anew", pick_s, naive_s, picks,
             naive_s / (greedy.quantile(0.5) / 1e6));
  fmt::print("both picked the same {} times of {}\n", same, compared);
  return 0;
}
