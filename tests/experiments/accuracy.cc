// The accuracy of the method's section 9, over random robots.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/model/units.h"
#include "tests/command_line/command_line.h"
#include "tests/experiments/trial.h"

namespace {

using namespace cellcal;
using experiments::Gears;
using experiments::median;
using experiments::NominalFigure;
using experiments::Outcome;
using experiments::Trial;

struct Level {
  const char* name;
  int spheres, fit;
  double touch_sigma_m;
  bool lengths, ideal;
  const char* target;
};
constexpr Level kLevels[] = {
    {"L0", 1, 50, 1e-9, false, true, "M1 < 1e-6"},
    {"L1", 1, 50, 0.03e-3, false, false, "M1 0.04/0.13  M2 0.12/0.30  M3 0.45/1.10"},
    {"L2", 4, 100, 0.03e-3, true, false, "M1 0.035/0.11 M2 0.08/0.20  M3 0.09/0.27"},
    {"L3", 6, 400, 0.03e-3, true, false, "M1 0.03/0.09  M2 0.04/0.12  M3 0.05/0.15"},
};

/// Least share of an arm's poses within u95 for which its bound holds.
constexpr double kHolds = 0.85;

struct Options {
  int robots = 20;
  int number = 0;  ///< of touches; 0: that of the level
  Trial trial;
  std::string level, arm;
  std::uint64_t seed = 1;
  bool each = false, both = false;
};

void run(const calib::Robot& robot, const Level& level, const Options& options) {
  Trial trial = options.trial;
  trial.spheres = level.spheres;
  trial.fit = options.number > 0 ? options.number : level.fit;
  trial.touch_sigma_m = level.touch_sigma_m;
  trial.lengths = level.lengths;
  trial.ideal = level.ideal;
  std::vector<Outcome> all;
  for (std::uint64_t k = 0; static_cast<int>(all.size()) < options.robots && k < 200; ++k)
    if (const auto o = experiments::run(robot, trial, options.seed * 1000 + k)) {
      all.push_back(*o);
      if (options.each)
        fmt::print(
            "  arm {}: M1 {:.3f} M2 {:.3f} M3 {:.3f} mm, M4 {:.1f} %, u95/rms {:.2f}{} alike "
            "{:.1f}, waves {}, false {}\n",
            k, 1e3 * o->m1, 1e3 * o->m2, 1e3 * o->m3, 100.0 * o->m4, o->u95 / o->rms,
            o->published ? "" : ", withheld", o->alike, o->waves, o->false_waves);
    }
  if (all.empty()) {
    fmt::print("{}: no cell could be planned\n", level.name);
    return;
  }
  const auto column = [&](double Outcome::*field, double scale) {
    std::vector<double> v;
    for (const Outcome& o : all) v.push_back(o.*field * scale);
    return v;
  };
  const auto show = [&](const char* name, double Outcome::*mean, double Outcome::*max) {
    const auto a = column(mean, 1e3), b = column(max, 1e3);
    fmt::print("  {:<26} median {:.3g}/{:.3g}   worst {:.3g}/{:.3g}\n", name, median(a), median(b),
               *std::max_element(a.begin(), a.end()), *std::max_element(b.begin(), b.end()));
  };
  fmt::print("{}: {} sphere(s), {} touches, {} robots      targets: {}\n", level.name,
             level.spheres, trial.fit, all.size(), level.target);
  show("M1 held-out touches [mm]", &Outcome::m1, &Outcome::m1_max);
  show("M2 near targets [mm]", &Outcome::m2, &Outcome::m2_max);
  show("M3 workspace [mm]", &Outcome::m3, &Outcome::m3_max);
  int waves = 0, false_waves = 0;
  for (const Outcome& o : all) {
    waves += o.waves;
    false_waves += o.false_waves;
  }
  fmt::print("  single waves found in the joints: {}, of no true wave {}\n", waves, false_waves);
  std::vector<double> cover, cover_local, ratio;
  double u95 = 0.0, square = 0.0;
  int published = 0, unchecked = 0, unchecked_beyond = 0;
  std::string reasons;
  for (const Outcome& o : all) {
    if (!o.published) {
      reasons += "    withheld: " + o.why_not + "\n";
      continue;
    }
    ++published;
    unchecked += o.unchecked ? 1 : 0;
    unchecked_beyond += o.unchecked && o.m4 < kHolds ? 1 : 0;
    cover.push_back(o.m4);
    cover_local.push_back(o.m4_local);
    ratio.push_back(o.u95 / o.rms);
    u95 += o.u95;
    square += o.rms * o.rms;
  }
  const auto least = [](const std::vector<double>& v) {
    return v.empty() ? 0.0 : *std::min_element(v.begin(), v.end());
  };
  fmt::print(
      "  published {}/{}; of these M4 median {:.1f} % worst {:.1f} % (near targets {:.1f} %, "
      "{:.1f} %), below 85 % {}; warned of an unchecked touch {}, {} of these below; "
      "u95/rms median {:.2f}, over all arms {:.2f}\n",
      published, all.size(), 100 * median(cover), 100 * least(cover), 100 * median(cover_local),
      100 * least(cover_local),
      std::ranges::count_if(cover, [](double share) { return share < kHolds; }), unchecked,
      unchecked_beyond, median(ratio), u95 / std::sqrt(square * std::max(published, 1)));
  fmt::print(
      "  effective radius off by [mm]: median {:.4f}, worst {:.4f}; predicted M3 median {:.3f}\n{}",
      median(column(&Outcome::rho_error, 1e3)),
      [&] {
        const auto v = column(&Outcome::rho_error, 1e3);
        return *std::max_element(v.begin(), v.end());
      }(),
      median(column(&Outcome::predicted_m3, 1e3)), reasons);
  const auto nominal = [&](const char* name, NominalFigure Outcome::*figure) {
    double off = 0.0, u = 0.0;
    for (const Outcome& o : all) {
      off += std::abs((o.*figure).stated - (o.*figure).real) / static_cast<double>(all.size());
      u += (o.*figure).u / static_cast<double>(all.size());
    }
    fmt::print(
        "  nominal model {:<13} {} of {} arms within U; off by {:.3f} mm, U {:.3f} mm in the mean\n",
        name, std::ranges::count_if(all, [&](const Outcome& o) { return (o.*figure).held(); }),
        all.size(), 1e3 * off, 1e3 * u);
  };
  nominal("workspace", &Outcome::nominal_workspace);
  nominal("near targets", &Outcome::nominal_near);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Options options;
    std::string gears = "harmonics", touches = "planned";
    bool masses_unstated = false, without_track = false;
    double tilt_deg = 0.0;
    options.arm = CELLCAL_EXPERIMENT_ROBOT;
    cellcal::CommandLine app(
        "Accuracy over random robots, beside the targets of the method (section 9).\n"
        "Example: accuracy --robots 20 --gears spectrum");
    app.option("--robots", options.robots, "Per level").between(1, 1000);
    app.option("--gears", gears, "Truth's form")
        .one_of({"none", "harmonics", "spectrum", "waves", "mixed"});
    app.option("--gear-arcsec", options.trial.gear_arcsec, "rms per joint");
    app.option("--touches", touches, "planned or random").one_of({"planned", "random"});
    app.option("--number", options.number, "Touches for the fit; 0: as many as the level has")
        .between(0, 2000);
    app.option("--masses-unstated", masses_unstated,
               "Links' masses and compliance stand in no file");
    app.option("--outliers-dropped", options.trial.outliers_dropped,
               "Gross touches are taken away before the estimate: what could be had at best");
    app.option("--each", options.each, "A line for every robot");
    app.option("--both", options.both,
               "Also the same touches without functions of the joints' angles");
    app.option(
        "--waves-known", options.trial.waves_known,
        "Order and size of the gears' waves stand in the robot file: what could be had at best");
    app.option("--size-known", options.trial.size_known,
               "The robot file states functions of the joints' angles of the gears' size");
    app.option("--level", options.level, "Only this one").one_of({"L0", "L1", "L2", "L3"});
    app.option("--robot", options.arm, "Robot file");
    app.option("--outliers", options.trial.outlier_share,
               "Share of the fit touches, 0.2 to 3 mm off")
        .between(0.0, 0.5);
    app.option("--load-kg", options.trial.load_kg,
               "On the flange where M2 to M4 are judged; 0: the tool alone")
        .between(0.0, 1000.0);
    app.option("--touched-kg", options.trial.touched_kg,
               "On the flange at every second touch; 0: the tool alone at all")
        .between(0.0, 1000.0);
    app.option("--without-track", without_track,
               "The arm of the robot file without its linear unit");
    app.option("--tilt-deg", tilt_deg,
               "Of the robot's foot: 0 on the floor, 90 on a wall, 180 under the ceiling")
        .between(0.0, 180.0);
    app.option("--seed", options.seed, "");
    if (const auto code = app.parse(argc, argv)) return *code;
    options.trial.gears = gears == "none"       ? Gears::kNone
                          : gears == "spectrum" ? Gears::kSpectrum
                          : gears == "waves"    ? Gears::kWaves
                          : gears == "mixed"    ? Gears::kMixed
                                                : Gears::kHarmonics;
    if (touches == "random") options.trial.criterion = calib::Criterion::kRandom;
    options.trial.masses_stated = !masses_unstated;
    calib::Robot robot = calib::load_robot(options.arm);
    if (without_track && robot.first_turning() > 0) robot.joints.erase(robot.joints.begin());
    robot.gravity_m_s2 = Eigen::AngleAxisd(tilt_deg * calib::kRadPerDeg, Eigen::Vector3d::UnitY()) *
                         robot.gravity_m_s2;
    for (const Level& level : kLevels) {
      if (!options.level.empty() && options.level != level.name) continue;
      calib::Robot arm = robot;
      if (level.ideal)
        for (calib::Joint& joint : arm.joints) {
          joint.mass_kg = 0.0;
          joint.compliance_sigma_rad_per_nm = 0.0;
        }
      run(arm, level, options);
      if (!options.both) continue;
      fmt::print("the same touches, without functions of the joints' angles:\n");
      Options plain = options;
      plain.trial.functions = false;
      run(arm, level, plain);
    }
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "accuracy: %s\n", e.what());
    return 1;
  }
}
