// Validity of the bound if the stated touch sigma is wrong, and if the arm has unmodelled errors.
// Coverage over postures without touches nearby, and the predicted error.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <vector>

#include "calib/files/files.h"
#include "tests/command_line/command_line.h"
#include "tests/experiments/trial.h"

namespace {

using namespace cellcal;
using experiments::median;
using experiments::Outcome;
using experiments::Trial;

constexpr double kNoiseM = 0.03e-3;

struct Arm {
  const char* name;
  experiments::Gears gears;
  double play_arcsec, field_m;
  double misfit_m;  ///< approximate residual of the fit, which a user would enter
  double reach_rad = 0.6;
};
constexpr Arm kArms[] = {
    {"as the model has it", experiments::Gears::kHarmonics, 0.0, 0.0, 0.03e-3},
    {"play 60 arcsec", experiments::Gears::kHarmonics, 60.0, 0.0, 0.10e-3},
    {"field 0.3 mm", experiments::Gears::kHarmonics, 0.0, 0.3e-3, 0.22e-3},
    {"short field 0.1 rad", experiments::Gears::kHarmonics, 0.0, 0.05e-3, 0.06e-3, 0.1},
    {"short field 0.03 rad", experiments::Gears::kHarmonics, 0.0, 0.05e-3, 0.06e-3, 0.03},
};

struct Row {
  const Arm& arm;
  const char* stated;
  double sigma_m;
  int repeated;
};

double least(const std::vector<double>& v) {
  return v.empty() ? 0.0 : *std::min_element(v.begin(), v.end());
}

void run(const calib::Robot& robot, Trial trial, const Row& row, int robots, std::uint64_t seed,
         bool each) {
  trial.gears = row.arm.gears;
  trial.play_arcsec = row.arm.play_arcsec;
  trial.field_m = row.arm.field_m;
  trial.field_reach_rad = row.arm.reach_rad;
  trial.touch_sigma_m = row.sigma_m;
  trial.noise_m = kNoiseM;
  trial.repeated = row.repeated;
  std::vector<double> cover, ratio, predicted, found, nominal, field;
  int arms = 0, published = 0, estimated = 0;
  std::string reasons;
  for (std::uint64_t k = 0; arms < robots && k < 200; ++k) {
    const auto o = experiments::run(robot, trial, seed * 1000 + k);
    if (!o) continue;
    ++arms;
    if (each) fmt::print("   alike {:.1f}", o->alike);
    if (each)
      fmt::print(
          "    {}: M4 {:.1f} %, M3 {:.3f} mm, predicted {:.3f}, nominal {:.2f}, field {:.3f}{} "
          "{}\n",
          k, 100 * o->m4, 1e3 * o->m3, 1e3 * o->predicted_m3, 1e3 * o->nominal_m3, 1e3 * o->field,
          o->estimated ? " estimated" : "", o->why_not);
    if (!o->published) {
      reasons += "      withheld: " + o->why_not + "\n";
      continue;
    }
    ++published;
    estimated += o->estimated ? 1 : 0;
    cover.push_back(o->m4);
    ratio.push_back(o->u95 / o->rms);
    predicted.push_back(1e3 * o->predicted_m3);
    found.push_back(1e3 * o->m3);
    field.push_back(1e3 * o->field);
  }
  fmt::print(
      "{:20} {:16} {:>7} {:5d} {:6d}/{:<3d} {:6d} {:8.1f} {:6.1f} {:9.3f} {:6.3f} {:7.3f} "
      "{:8.2f}\n{}",
      row.arm.name, row.stated, row.repeated > 0 ? fmt::format("{} x 4", row.repeated) : "none",
      trial.fit, published, arms, estimated, 100 * median(cover), 100 * least(cover),
      median(predicted), median(found), median(field), median(ratio), each ? reasons : "");
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    int robots = 10;
    std::uint64_t seed = 1;
    bool each = false;
    std::string file = CELLCAL_EXPERIMENT_ROBOT, only, sigma;
    std::vector<int> fits{100, 400};
    cellcal::CommandLine app(
        "Coverage of unseen postures where the touch sigma or the model is not right.\n"
        "Example: discrepancy --robots 20");
    app.option("--robots", robots, "Per line").between(1, 500);
    app.option("--seed", seed, "");
    app.option("--touches", fits, "Fit touches");
    app.option("--arm", only, "Only arms whose name begins so");
    app.option("--sigma", sigma, "Only stated sigmas whose name begins so");
    app.option("--each", each, "A line for every arm");
    if (const auto code = app.parse(argc, argv)) return *code;
    const calib::Robot robot = calib::load_robot(file);
    fmt::print("{:20} {:16} {:>7} {:>5} {:>10} {:>6} {:>8} {:>6} {:>9} {:>6} {:>7} {:>8}\n", "arm",
               "stated sigma", "repeats", "fit", "published", "estim.", "M4 med", "worst",
               "predicted", "true", "field", "u95/rms");
    for (const int fit : fits)
      for (const Arm& arm : kArms)
        for (const int repeated : {0, 5}) {
          if (!std::string(arm.name).starts_with(only)) continue;
          Trial trial;
          trial.fit = fit;
          for (const Row& row : {Row{arm, "right", kNoiseM, repeated},
                                 Row{arm, "whole misfit", arm.misfit_m, repeated},
                                 Row{arm, "5 times too small", kNoiseM / 5.0, repeated}})
            if (std::string(row.stated).starts_with(sigma))
              run(robot, trial, row, robots, seed, each);
        }
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "discrepancy: %s\n", e.what());
    return 1;
  }
}
