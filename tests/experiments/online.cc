// A complete calibration touch by touch, to the required accuracy: number of touches, robot time,
// and true error of the result.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "calib/files/files.h"
#include "tests/command_line/command_line.h"
#include "tests/experiments/trial.h"

int main(int argc, char** argv) {
  using namespace cellcal;  // NOLINT: an experiment's own file
  using experiments::median;
  try {
    cellcal::CommandLine app(
        "Touches and robot time of a calibration that stops where the accuracy asked for is "
        "reached.\n"
        "Example: online --robots 20 --goal 0.15 --gears spectrum --gear-arcsec 20");
    int robots = 10, spheres = 4, most = 200;
    double goal_mm = 0.15, failing = 0.0;
    std::string arm = CELLCAL_EXPERIMENT_ROBOT, gears = "harmonics";
    experiments::Trial trial;
    app.option("--robots", robots, "").between(1, 1000);
    app.option("--spheres", spheres, "").between(1, 6);
    app.option("--goal", goal_mm, "u95, mean over the workspace [mm]");
    app.option("--most", most, "Touches at most");
    app.option("--failing", failing, "Share of touches that cannot be made").between(0.0, 0.9);
    app.option("--robot", arm, "Robot file");
    app.option("--gears", gears, "Truth's form").one_of({"harmonics", "spectrum"});
    app.option("--gear-arcsec", trial.gear_arcsec, "Truth's gears, rms per joint")
        .between(0.0, 100.0);
    if (const auto code = app.parse(argc, argv)) return *code;
    const calib::Robot robot = calib::load_robot(arm);
    trial.spheres = spheres;
    if (gears == "spectrum") trial.gears = experiments::Gears::kSpectrum;
    trial.lengths = spheres > 1;
    fmt::print(
        "goal: u95 {} mm; {} spheres; at the robot file's own axis speeds\n"
        "robot touches  minutes  u95 foreseen   M3 foreseen   true M3 mean/max   inside u95   "
        "ended by\n",
        goal_mm, spheres);
    std::vector<double> touches, minutes, m3, m3_max, covered;
    for (std::uint64_t k = 0; static_cast<int>(touches.size()) < robots && k < 200; ++k) {
      const auto o =
          experiments::run_online(robot, trial, {goal_mm * 1e-3, most, 0.02}, failing, 7000 + k);
      if (!o) continue;
      touches.push_back(o->touches);
      minutes.push_back(o->outcome.minutes);
      m3.push_back(o->outcome.m3 * 1e3);
      m3_max.push_back(o->outcome.m3_max * 1e3);
      covered.push_back(o->outcome.m4);
      fmt::print("{:5d} {:7d} {:8.1f} {:13.3f} {:13.3f} {:11.3f} / {:.3f} {:9.1f} %   {}\n",
                 touches.size(), o->touches, o->outcome.minutes, o->u95_m * 1e3,
                 o->outcome.planned_m3 * 1e3, o->outcome.m3 * 1e3, o->outcome.m3_max * 1e3,
                 100.0 * o->outcome.m4, o->why);
      std::fflush(stdout);
    }
    const auto most_of = [](const std::vector<double>& v) {
      return *std::max_element(v.begin(), v.end());
    };
    fmt::print(
        "median: {:.0f} touches, {:.1f} minutes, true M3 {:.3f} / {:.3f} mm\n"
        "worst:  {:.0f} touches, {:.1f} minutes, true M3 {:.3f} / {:.3f} mm; least inside u95 {:.1f} %\n",
        median(touches), median(minutes), median(m3), median(m3_max), most_of(touches),
        most_of(minutes), most_of(m3), most_of(m3_max),
        100.0 * *std::min_element(covered.begin(), covered.end()));
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "online: %s\n", e.what());
    return 1;
  }
}
