// Compares kinds of targets at the same number of touches; see README.md.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <limits>

#include "calib/files/files.h"
#include "calib/identify/identify.h"
#include "calib/model/linear.h"
#include "drivers/units.h"
#include "sim/cell/compare.h"
#include "tests/experiments/constraints/stage.h"

namespace {

using namespace cellcal;
namespace constraints = sim::constraints;

using drivers::kMmPerM;
constexpr int kTouches[] = {30, 50, 100};
/// True offset of the contact, 1 sigma: half of the prior in the cell.
constexpr double kRhoSigmaM = 0.15e-3;
/// Medians within this factor may change order with other robots.
constexpr double kSame = 1.25;

struct Options {
  int robots = 20;
  double noise_mm = 0.03;
  double gear_arcsec = 10.0;
  unsigned seed = 1;
};

/// In millimetres, one entry per identified robot.
struct Figures {
  std::vector<double> m2, m2_max, m3, m3_max, predicted_m3, before;
  int published = 0, failed = 0;
};

void add(const Options& options, const calib::Cell& cell, int touches, int robot, Figures& f) {
  const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(robot);
  sim::TruthOptions truth;
  truth.seed = seed;
  truth.gear_arcsec = options.gear_arcsec;
  const constraints::Stage stage = constraints::set_up(cell, truth);
  constraints::TouchOptions touching;
  touching.fit = touches;
  touching.noise_m = options.noise_mm / kMmPerM;
  touching.rho_m = kRhoSigmaM * calib::Random(seed + 31).normal();
  touching.seed = seed;
  const auto made = constraints::touch(stage, touching);
  std::vector<calib::JointVector> joints;
  for (const calib::Touch& touch : made) joints.push_back(touch.joint_rad);
  try {
    const calib::Calibration result = calib::identify(stage.cell, made);
    const sim::TruthFigures real = sim::truth_figures(stage.truth, result, joints);
    f.m2.push_back(real.local.mean_m * kMmPerM);
    f.m2_max.push_back(real.local.max_m * kMmPerM);
    f.m3.push_back(real.workspace.mean_m * kMmPerM);
    f.m3_max.push_back(real.workspace.max_m * kMmPerM);
    f.predicted_m3.push_back(result.predicted_workspace_m * kMmPerM);
    f.before.push_back(real.workspace.nominal_mean_m * kMmPerM);
    f.published += result.verdict.publish() ? 1 : 0;
  } catch (const calib::IdentifyError& error) {
    ++f.failed;
    fmt::print(stderr, "robot {}: {}\n", robot + 1, error.what());
  }
}

/// Evaluates the claim that spheres are better than planes, points and distances.
void conclude(const std::vector<constraints::Layout>& all, const std::vector<double>& m3) {
  const auto of = [&](std::string_view name) {
    for (std::size_t i = 0; i < all.size(); ++i)
      if (all[i].name == name) return m3[i];
    return std::numeric_limits<double>::quiet_NaN();
  };
  fmt::print(
      "\nThe claim that a sphere beats planes, points and distances, at {} random touches, median "
      "mean error over the workspace:\n",
      kTouches[std::size(kTouches) - 1]);
  for (const auto& [sphere, other] : {std::pair{"1 sphere", "1 wire"},
                                      {"1 sphere", "3 planes"},
                                      {"1 sphere", "4 points"},
                                      {"4 spheres, lengths", "3 planes"},
                                      {"4 spheres, lengths", "4 points"},
                                      {"4 spheres, lengths", "4 points, lengths"},
                                      {"4 spheres, lengths", "tracker"}}) {
    const double a = of(sphere), b = of(other);
    const char* words = a * kSame < b ? "holds" : b * kSame < a ? "does not hold" : "no difference";
    fmt::print("  {:<18} {:.3f} mm, {:<17} {:.3f} mm: {}\n", sphere, a, other, b, words);
  }
  for (const bool length : {true, false}) {
    double least = std::numeric_limits<double>::infinity(), most = 0.0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (all[i].measures_length != length) continue;
      least = std::min(least, m3[i]);
      most = std::max(most, m3[i]);
    }
    fmt::print("{} {:.3f} to {:.3f} mm.\n",
               length ? "Where a length is measured (certified distances, wire, tracker):"
                      : "Where none is (spheres, planes or points alone):",
               least, most);
  }
}

int run(const Options& options) {
  calib::Cell base = calib::load_cell(CELLCAL_CONSTRAINTS_CELL);
  base.touch_sigma_m = options.noise_mm / kMmPerM;
  const auto all = constraints::layouts(base);
  fmt::print(
      "{} random robots ({}), gear waves {:.0f} arcsec, random reachable poses.\n"
      "Noise {} mm, 1 sigma: along the normal of spheres and planes, along the wire, and along "
      "each of the three axes of points and trackers.\n"
      "M2: 3-D error within 150 mm of the targets. M3: over the workspace. Medians over the "
      "robots, "
      "mm, after a 6-DoF alignment.\n\n",
      options.robots, base.robot.name, options.gear_arcsec, options.noise_mm);
  fmt::print("{:<19} {:>7} {:>8} {:>8} {:>8} {:>8} {:>12} {:>10}\n", "targets", "touches",
             "M2 mean", "M2 max", "M3 mean", "M3 max", "M3 predicted", "published");
  std::vector<double> last, before;
  for (const constraints::Layout& layout : all) {
    for (const int touches : kTouches) {
      Figures f;
      for (int robot = 0; robot < options.robots; ++robot)
        add(options, layout.cell, touches, robot, f);
      fmt::print("{:<19} {:>7} {:>8.3f} {:>8.3f} {:>8.3f} {:>8.3f} {:>12.3f} {:>7}/{}\n",
                 layout.name, touches, calib::median_between(f.m2), calib::median_between(f.m2_max),
                 calib::median_between(f.m3), calib::median_between(f.m3_max),
                 calib::median_between(f.predicted_m3), f.published, options.robots);
      std::fflush(stdout);
      if (touches == kTouches[std::size(kTouches) - 1]) last.push_back(calib::median_between(f.m3));
      before.insert(before.end(), f.before.begin(), f.before.end());
    }
  }
  fmt::print("{:<19} {:>7} {:>8} {:>8} {:>8.3f}\n", "not calibrated", "", "", "",
             calib::median_between(before));
  conclude(all, last);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Accuracy over the workspace by kind of target, at equal numbers of touches.\n"
      "Example: sim/compare-constraints --robots 20");
  Options options;
  app.add_option("--robots", options.robots, "random robots")->check(CLI::Range(1, 1000));
  app.add_option("--noise", options.noise_mm, "noise of a touch, 1 sigma, mm")
      ->check(CLI::Range(1e-4, 10.0));
  app.add_option("--gears", options.gear_arcsec, "waves of each gear, 1 sigma, arc seconds")
      ->check(CLI::Range(0.0, 100.0));
  app.add_option("--seed", options.seed, "of the first robot");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    return run(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "compare-constraints: {}\n", error.what());
    return 1;
  }
}
