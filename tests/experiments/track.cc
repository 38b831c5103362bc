// An arm on a linear unit: over the whole track, as computed by the controller, with the arm
// calibrated and the track as drawn, and with both calibrated.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "calib/files/files.h"
#include "tests/command_line/command_line.h"
#include "tests/experiments/trial.h"

namespace {

using namespace cellcal;
using experiments::median;
using experiments::Outcome;
using experiments::Trial;

struct Column {
  std::vector<double> nominal, mean, max, cover, ratio;
  int published = 0;
  std::string reasons;

  void add(std::uint64_t seed, const Outcome& o, bool each) {
    nominal.push_back(1e3 * o.nominal_workspace.real);
    mean.push_back(1e3 * o.m3);
    max.push_back(1e3 * o.m3_max);
    if (each)
      fmt::print("  arm {}: M1 {:.3f} M3 {:.3f}/{:.3f} mm, M4 {:.1f} %, u95/rms {:.2f}{}\n", seed,
                 1e3 * o.m1, mean.back(), max.back(), 100.0 * o.m4, o.u95 / o.rms,
                 o.published ? "" : ", withheld");
    if (!o.published) {
      reasons += fmt::format("    arm {} withheld: {}\n", seed, o.why_not);
      return;
    }
    ++published;
    cover.push_back(100.0 * o.m4);
    ratio.push_back(o.u95 / o.rms);
  }

  void print(const char* name) const {
    const auto worst = [](const std::vector<double>& v) {
      return v.empty() ? 0.0 : *std::ranges::max_element(v);
    };
    fmt::print("| {} | {:.3f}/{:.3f} | {:.3f}/{:.3f} | {:.1f}, {:.1f} % | {:.2f} | {} of {} |\n",
               name, median(mean), median(max), worst(mean), worst(max), median(cover),
               cover.empty() ? 0.0 : *std::ranges::min_element(cover), median(ratio), published,
               mean.size());
  }
};

/// A cell file that assumes the linear unit to be exact.
calib::Robot with_exact_track(calib::Robot robot) {
  robot.joints[0].guide = calib::LinearGuide{robot.joints[0].guide->along};
  return robot;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    int robots = 20;
    std::uint64_t first = 1;
    bool each = false, only_both = false;
    Trial trial;
    trial.spheres = 6;
    trial.fit = 130;
    trial.longest_m = 1.5;
    std::string touches = "planned";
    cellcal::CommandLine app(
        "A KR 16 on a linear unit of 3 m (scale 0.3 mm/m, pitch 0.5 mrad/m, straightness 0.2 mm): M3 "
        "[mm] over the whole track.\nExample: track --robots 20");
    app.option("--robots", robots, "Random arms and tracks").between(1, 100);
    app.option("--number", trial.fit, "Touches for the fit; 30 more are held out")
        .between(10, 2000);
    app.option("--spheres", trial.spheres, "Along the track").between(1, 6);
    app.option("--touches", touches, "planned or random").one_of({"planned", "random"});
    app.option("--each", each, "A line for every arm");
    app.option("--only-both", only_both, "Without the estimate that takes the track for exact");
    app.option("--seed", first, "Of the first arm");
    if (const auto code = app.parse(argc, argv)) return *code;
    if (touches == "random") trial.criterion = calib::Criterion::kRandom;
    const calib::Robot robot = calib::load_robot(CELLCAL_TRACK_ROBOT);
    Column arm, both;
    for (std::uint64_t seed = first; static_cast<int>(both.mean.size()) < robots; ++seed) {
      if (seed > first + 200) throw std::runtime_error("no cell could be planned");
      const auto session = experiments::measured(robot, trial, seed);
      if (!session) continue;
      both.add(seed, experiments::judged(session->world, session->touches), each);
      if (only_both) continue;
      experiments::World exact = session->world;
      exact.cell.robot = with_exact_track(exact.cell.robot);
      arm.add(seed, experiments::judged(exact, session->touches), false);
    }
    fmt::print("{} touches, {} spheres; nominal arm and track {:.2f} mm in the median\n\n",
               trial.fit, trial.spheres, median(both.nominal));
    fmt::print(
        "| calibrated | M3 median | worst | inside u95: median, worst | u95/rms | published |\n"
        "|---|---|---|---|---|---|\n");
    if (!only_both) arm.print("arm alone, track as drawn");
    both.print("arm and track");
    fmt::print("{}", both.reasons);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "track: %s\n", e.what());
    return 1;
  }
}
