// Duration of an identification, of its parts, and its memory. One cell of four spheres; every run
// identifies another random arm. Prints figures; no threshold.

#include <fmt/format.h>
#include <malloc.h>

#include <Eigen/Cholesky>
#include <chrono>
#include <fstream>

#include "calib/estimate/evidence.h"
#include "calib/estimate/incremental_estimate.h"
#include "calib/estimate/problem.h"
#include "calib/estimate/region.h"
#include "calib/estimate/solve.h"
#include "calib/identify/identify.h"
#include "tests/bench/times.h"
#include "tests/calib/simulate.h"
#include "tests/command_line/command_line.h"

namespace {

using namespace cellcal;         // NOLINT: a benchmark's own file
using namespace cellcal::calib;  // NOLINT

template <typename Work>
void measure(bench::Times& times, const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  times.add(std::chrono::steady_clock::now() - start);
}

double ms(double us) { return us * 1e-3; }

/// Physical memory of this process, as reported by the kernel.
class Memory {
 public:
  /// Restarts the peak. Memory that earlier runs left to the allocator is returned first.
  void begin() {
    ::malloc_trim(0);
    std::ofstream("/proc/self/clear_refs") << "5";  // if refused: the peak of the whole process
    before_mb_ = figure_mb("VmRSS:");
  }
  void end() {
    const double peak = figure_mb("VmHWM:");
    peak_mb_ = std::max(peak_mb_, peak);
    added_mb_ = std::max(added_mb_, peak - before_mb_);
  }
  double peak_mb() const { return peak_mb_; }
  double added_mb() const { return added_mb_; }

 private:
  static double figure_mb(const std::string& key) {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;)
      if (double kb = 0.0; word == key && status >> kb) return kb / 1024.0;
    return 0.0;
  }
  double before_mb_ = 0.0, peak_mb_ = 0.0, added_mb_ = 0.0;
};

/// The parts of one identification, each on its own, with all unknowns of the fullest level.
struct Parts {
  bench::Times solve, covariance, levels, predicted;
  bench::Times derivatives;  ///< position of the tip and its derivatives, all touches once
};

void measure_parts(const Cell& cell, const std::vector<Touch>& touches, const Calibration& result,
                   Parts& parts) {
  const Cell levelled = at_level(cell, ModelLevel{});
  const ArmModel arm(levelled.robot, levelled.tool);
  std::vector<TargetPlace> centres;
  for (const TargetResult& target : result.targets) centres.emplace_back(target.centre_m);
  const Problem problem(levelled, arm, touches, centres);
  const std::vector<bool> use(touches.size(), true);
  const int n = problem.size();
  Eigen::VectorXd u;
  measure(parts.solve, [&] {  // from zero errors, coarse and then exact
    u = solve(problem, Eigen::VectorXd::Zero(n), {use, 0.0, 100, 1e-3}).u;
    u = solve(problem, u, {use, 0.0, 100, 0.0}).u;
  });
  Eigen::MatrixXd covariance;
  measure(parts.covariance, [&] {
    const Linearisation linear = linearise(problem, u, use);
    Eigen::MatrixXd information = linear.jacobian.transpose() * linear.jacobian;
    for (int i = 0; i < n; ++i)
      information(i, i) += std::pow(problem.unknowns()[i].prior_weight, 2);
    covariance = information.llt().solve(Eigen::MatrixXd::Identity(n, n));
  });
  measure(parts.levels,
          [&] { (void)mean_over_levels(problem, u, linearise(problem, u, use), usual_levels()); });
  measure(parts.predicted, [&] {
    constexpr int kPoses = 300;
    constexpr double kRippleRad = 2.4e-5;  // 5 arcsec
    Eigen::VectorXd scale(arm.size());
    for (int i = 0; i < arm.size(); ++i) scale[i] = problem.unknowns()[i].scale;
    const Eigen::VectorXd at = problem.to_si(u);
    const auto poses = workspace_poses(arm, kPoses, 1);
    const Eigen::MatrixXd moves = aligned_moves(arm, poses, at.data(), scale);
    (void)predicted_mean_error_m(moves, covariance.topLeftCorner(arm.size(), arm.size()),
                                 ripple_variance_m2(arm, poses, kRippleRad));
  });
  const Eigen::VectorXd x = problem.to_si(u);
  Eigen::Matrix3Xd jacobian(3, arm.size());
  volatile double sink = 0.0;  // unused results would be optimised away
  measure(parts.derivatives, [&] {
    for (std::size_t i = 0; i < touches.size(); ++i)
      sink = sink + arm.position(problem.pose(i), x.data(), jacobian).x() + jacobian(0, 0);
  });
}

/// Touches added to an incremental estimate: those that update it near its point of linearisation,
/// and those after which all are linearised and judged again.
struct More {
  bench::Times one, anew;
};

void measure_more(const Cell& cell, std::vector<Touch> touches, More& more) {
  const auto last = static_cast<std::ptrdiff_t>(std::min<std::size_t>(20, touches.size() / 4));
  const std::vector<Touch> added(touches.end() - last, touches.end());
  touches.resize(touches.size() - added.size());
  IncrementalEstimate incremental(cell, std::move(touches));
  for (const Touch& touch : added) {
    bench::Times took;
    bool anew = false;
    measure(took, [&] { anew = incremental.add(touch).anew; });
    (anew ? more.anew : more.one).add(took.worst());
  }
}

}  // namespace

int main(int argc, char** argv) {
  cellcal::CommandLine app{"Times identify(): median, p95 and worst, its parts, and memory."};
  std::vector<int> counts = {50, 100, 200, 400};
  int runs = 30;
  app.option("--touches", counts, "Numbers of fit touches").between(20, 1000000);
  app.option("--runs", runs, "Random arms per number").between(1, 10000);
  if (const auto code = app.parse(argc, argv)) return *code;

  fmt::print(
      "identification with covariance, predicted error and verdict; {} random arms each; ms\n"
      "                      identify()                 parts on their own, median\n"
      "touches parameters   median      p95    worst      solve covariance   levels predicted\n",
      runs);
  struct Extra {
    int count;
    Memory memory;
    double derivatives_us;
    More more;
  };
  std::vector<Extra> extras;
  const Cell& cell = testing::demo_cell();
  for (const int count : counts) {
    bench::Times whole;
    Memory memory;
    Parts parts;
    More more;
    std::size_t parameters = 0;
    for (int run = 0; run < runs; ++run) {
      const auto seed = static_cast<unsigned>(run + 1);
      sim::TruthOptions options;
      options.seed = seed;
      options.gear_arcsec = 10.0;
      const auto made =
          testing::make_touches(cell, sim::draw_truth(cell, options), {.fit = count, .seed = seed});
      Calibration result;
      measure(whole, [&] { result = identify(cell, made.touches); });
      memory.begin();  // once more: fresh pages take time
      (void)identify(cell, made.touches);
      memory.end();
      parameters = std::max(parameters, result.parameters.size());
      measure_parts(cell, made.touches, result, parts);
      measure_more(cell, made.touches, more);
    }
    fmt::print("{:7d} {:10d} {:8.1f} {:8.1f} {:8.1f}   {:8.2f} {:10.2f} {:8.2f} {:9.2f}\n", count,
               parameters, ms(whole.quantile(0.5)), ms(whole.quantile(0.95)), ms(whole.worst()),
               ms(parts.solve.quantile(0.5)), ms(parts.covariance.quantile(0.5)),
               ms(parts.levels.quantile(0.5)), ms(parts.predicted.quantile(0.5)));
    extras.push_back({count, memory, parts.derivatives.quantile(0.5), more});
  }
  fmt::print(
      "\n        process's peak   of that, added by   tip's position and derivatives\n"
      "touches    memory, MB      identify(), MB      all touches, us   one touch, us\n");
  for (const Extra& extra : extras)
    fmt::print("{:7d} {:13.1f} {:19.1f} {:20.1f} {:15.2f}\n", extra.count, extra.memory.peak_mb(),
               extra.memory.added_mb(), extra.derivatives_us, extra.derivatives_us / extra.count);
  fmt::print(
      "\n        one more touch, mean of the levels and covariance included; ms   all judged anew\n"
      "touches             median      p95    worst                     share   median    worst\n");
  for (Extra& extra : extras) {
    bench::Times &one = extra.more.one, &anew = extra.more.anew;
    const double share = static_cast<double>(anew.count()) /
                         static_cast<double>(std::max<std::size_t>(1, one.count() + anew.count()));
    fmt::print("{:7d} {:18.2f} {:8.2f} {:8.2f} {:23.0f} % {:8.2f} {:8.2f}\n", extra.count,
               ms(one.quantile(0.5)), ms(one.quantile(0.95)), ms(one.worst()), 100.0 * share,
               ms(anew.quantile(0.5)), ms(anew.worst()));
  }
  return 0;
}
