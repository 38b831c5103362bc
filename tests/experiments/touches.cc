// Value of touches: accuracy by their number and by the method of their choice.

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <map>

#include "calib/files/files.h"
#include "tests/command_line/command_line.h"
#include "tests/experiments/trial.h"

namespace {

using namespace cellcal;
using calib::Criterion;
using experiments::median;
using experiments::Outcome;

struct Way {
  Criterion criterion;
  const char* name;
};
constexpr Way kWays[] = {{Criterion::kI, "I-optimal"},
                         {Criterion::kD, "D-optimal"},
                         {Criterion::kEven, "even"},
                         {Criterion::kRandom, "random"}};

/// Number of touches at which the accuracy of a method reaches `m3`, interpolated on a log scale; 0
/// if it does not.
double touches_for(const std::map<int, double>& m3_of, double m3) {
  for (auto it = m3_of.begin(); it != m3_of.end(); ++it) {
    if (it->second > m3) continue;
    if (it == m3_of.begin()) return it->first;
    const auto before = std::prev(it);
    const double share = std::log(before->second / m3) / std::log(before->second / it->second);
    return before->first * std::pow(static_cast<double>(it->first) / before->first, share);
  }
  return 0.0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    cellcal::CommandLine app(
        "Predicted and true accuracy by number of touches and by how they were chosen.\n"
        "Example: touches --robots 20 --spheres 4 --touches 30,100");
    int robots = 10;
    std::vector<int> spheres = {1, 2, 4}, counts = {25, 30, 40, 50, 75, 100, 150, 200};
    double outliers = experiments::Trial{}.outlier_share;
    std::string arm = CELLCAL_EXPERIMENT_ROBOT;
    app.option("--robots", robots, "Per line").between(1, 1000);
    app.option("--spheres", spheres, "").between(1, 6);
    app.option("--touches", counts, "").between(10, 1000);
    app.option("--outliers", outliers, "Share of the fit touches that are grossly wrong")
        .between(0.0, 0.5);
    app.option("--robot", arm, "Robot file");
    if (const auto code = app.parse(argc, argv)) return *code;
    const calib::Robot robot = calib::load_robot(arm);
    fmt::print(
        "medians over {} robots, mm; M3 over the workspace, M2 within 150 mm of the spheres; gears "
        "10 arcsec, touch noise 0.03 mm, {:.0f} % outliers\n"
        "spheres touches  chosen      planned M3  identified M3   true M2 mean/max   true M3 "
        "mean/max"
        "   robot min\n",
        robots, 100.0 * outliers);
    for (const int count_spheres : spheres) {
      std::map<Criterion, std::map<int, double>> m3_of, identified_of;
      for (const int count : counts)
        for (const Way& way : kWays) {
          experiments::Trial trial;
          trial.spheres = count_spheres;
          trial.lengths = count_spheres > 1;
          trial.fit = count;
          trial.check = 8;
          trial.criterion = way.criterion;
          trial.outlier_share = outliers;
          std::map<std::string, std::vector<double>> v;
          int made = 0;
          for (std::uint64_t k = 0; made < robots && k < 200; ++k) {
            const auto o = experiments::run(robot, trial, 5000 + k);
            if (!o) continue;
            ++made;
            v["planned"].push_back(o->planned_m3 * 1e3);
            v["predicted"].push_back(o->predicted_m3 * 1e3);
            v["m2"].push_back(o->m2 * 1e3);
            v["m2_max"].push_back(o->m2_max * 1e3);
            v["m3"].push_back(o->m3 * 1e3);
            v["m3_max"].push_back(o->m3_max * 1e3);
            v["minutes"].push_back(o->minutes);
          }
          if (made == 0) continue;
          const double m3 = median(v["m3"]);
          m3_of[way.criterion][count] = m3;
          identified_of[way.criterion][count] = median(v["predicted"]);
          fmt::print(
              "{:7d} {:7d}  {:<10} {:10.3f} {:14.3f} {:10.3f} / {:.3f} {:10.3f} / {:.3f} {:9.1f}\n",
              count_spheres, count, way.name, median(v["planned"]), median(v["predicted"]),
              median(v["m2"]), median(v["m2_max"]), m3, median(v["m3_max"]), median(v["minutes"]));
          std::fflush(stdout);
        }
      // By the truth; and by the estimator's prediction, which scatters less from arm to arm.
      for (const auto& [count, m3] : m3_of[Criterion::kRandom]) {
        const double needed = touches_for(m3_of[Criterion::kI], m3);
        const double predicted =
            touches_for(identified_of[Criterion::kI], identified_of[Criterion::kRandom][count]);
        if (needed > 0.0 && predicted > 0.0)
          fmt::print(
              "  {} sphere(s): what {} random touches reach, {:.0f} I-optimal ones do: {:.0f} %; "
              "by "
              "the identified M3 {:.0f}: {:.0f} %\n",
              count_spheres, count, needed, 100.0 * needed / count, predicted,
              100.0 * predicted / count);
      }
    }
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "touches: %s\n", e.what());
    return 1;
  }
}
