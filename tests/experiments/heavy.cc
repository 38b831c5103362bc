// Heavy arms: a counterbalance between column and link arm, and gears that are softer at low load.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "calib/files/files.h"
#include "calib/files/robot_file.h"
#include "calib/model/units.h"
#include "tests/command_line/command_line.h"
#include "tests/experiments/trial.h"

namespace {

using namespace cellcal;
using experiments::median;
using experiments::Trial;

/// Masses and centres assumed for simulation; compliance 1 sigma of gears of 3e6 N m/rad.
calib::Robot with_masses(calib::Robot robot) {
  constexpr double kMassKg[] = {0.0, 210.0, 180.0, 110.0, 60.0, 25.0};
  for (std::size_t i = 0; i < robot.joints.size(); ++i) {
    calib::Joint& joint = robot.joints[i];
    joint.mass_kg = kMassKg[i];
    if (i == 1) joint.com_m = {-0.55 * joint.a_m, 0.0, 0.1};
    if (i == 2) joint.com_m = {-0.05, 0.0, 0.15};
    if (i == 3) joint.com_m = {0.0, 0.45, 0.0};
    if (i > 0 && i < 5) joint.compliance_sigma_rad_per_nm = 4e-7;
  }
  return robot;
}

struct Row {
  const char* name;
  double spring_nm, soft_arcsec;
};
constexpr Row kRows[] = {{"spring of 5 kN m", 5000.0, 0.0},
                         {"gears 60 arcsec softer at small loads", 0.0, 60.0},
                         {"both", 5000.0, 60.0},
                         {"neither", 0.0, 0.0}};

void run(const calib::Robot& robot, const Row& row, Trial trial, int robots) {
  trial.spring_nm = row.spring_nm;
  trial.soft_rad = row.soft_arcsec * calib::kRadPerArcsec;
  for (const bool stated : {false, true}) {
    trial.heavy_stated = stated;
    std::vector<double> mean, max, cover, ratio, nominal;
    int published = 0;
    for (std::uint64_t seed = 1; static_cast<int>(mean.size()) < robots && seed < 200; ++seed) {
      const auto o = experiments::run(robot, trial, seed);
      if (!o) continue;
      mean.push_back(1e3 * o->m3);
      max.push_back(1e3 * o->m3_max);
      nominal.push_back(1e3 * o->nominal_workspace.real);
      published += o->published ? 1 : 0;
      if (!o->published) continue;
      cover.push_back(100.0 * o->m4);
      ratio.push_back(o->u95 / o->rms);
    }
    if (mean.empty()) throw std::runtime_error("no cell could be planned");
    fmt::print(
        "| {} | {} | {:.2f} | {:.3f}/{:.3f} | {:.3f} | {:.1f}, {:.1f} % | {:.2f} | {} of {} |\n",
        row.name, stated ? "stated" : "linear compliance", median(nominal), median(mean),
        median(max), *std::ranges::max_element(mean), median(cover),
        cover.empty() ? 0.0 : *std::ranges::min_element(cover), median(ratio), published,
        mean.size());
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    int robots = 20;
    Trial trial;
    trial.size = 2.0;
    trial.compliance_rad_per_nm = 3e-7;
    cellcal::CommandLine app(
        "A KR 210 with a counterbalance and with gears of rising stiffness: M3 [mm] with linear "
        "compliance alone, and with both in the robot file.\nExample: heavy --robots 20");
    app.option("--robots", robots, "Per row").between(1, 100);
    app.option("--number", trial.fit, "Touches for the fit").between(10, 2000);
    if (const auto code = app.parse(argc, argv)) return *code;
    const calib::Robot robot = with_masses(calib::load_robot(CELLCAL_EXPERIMENT_HEAVY));
    fmt::print(
        "| truth | robot file | nominal arm | M3 median | worst mean | inside u95: median, worst | "
        "u95/rms | published |\n|---|---|---|---|---|---|---|---|\n");
    for (const Row& row : kRows) run(robot, row, trial, robots);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "heavy: %s\n", e.what());
    return 1;
  }
}
