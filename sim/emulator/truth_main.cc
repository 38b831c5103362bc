// A calibration against the truth that a seed stands for.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "sim/cell/compare.h"
#include "sim/cell/physical_cell.h"
#include "sim/emulator/options.h"

namespace {

using namespace cellcal;

void print(const char* name, const sim::RegionFigures& f) {
  fmt::print("  {:<34} {:>8.3f} {:>8.3f}   {:>8.3f} {:>8.3f}   {:>5.1f} %\n", name,
             f.nominal_mean_m * 1e3, f.nominal_max_m * 1e3, f.mean_m * 1e3, f.max_m * 1e3,
             f.covered * 100.0);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    sim::EmulatorOptions options;
    std::string calibration, touches;
    CLI::App app(
        "Compares a calibration of the emulated cell with its hidden truth.\n"
        "Example: cellcal-truth --cell cell.toml --seed 1 --calibration cal.json "
        "--touches touches.csv");
    sim::add_truth_options(app, options);
    app.add_option("--calibration", calibration, "Result to judge")->check(CLI::ExistingFile);
    app.add_option("--touches", touches, "Its touches: local poses lie near them")
        ->required()
        ->check(CLI::ExistingFile);
    CLI11_PARSE(app, argc, argv);
    const calib::Cell cell = calib::load_cell(options.cell);
    const sim::Truth truth = sim::draw_truth(cell, options.truth);
    const sim::PhysicalCell physical(truth);
    std::vector<calib::JointVector> around;
    double sum_m = 0.0, worst_m = 0.0;
    for (const calib::Touch& touch : calib::load_touches(touches, cell)) {
      around.push_back(touch.joint_rad);
      const double off_m = std::abs(physical.gap_m(touch.joint_rad));
      sum_m += off_m;
      worst_m = std::max(worst_m, off_m);
    }
    fmt::print("Latched touches off the true surfaces [mm]: mean {:.4f}, max {:.4f} ({} touches)\n",
               around.empty() ? 0.0 : sum_m / static_cast<double>(around.size()) * 1e3,
               worst_m * 1e3, around.size());
    if (calibration.empty()) return 0;
    const sim::TruthFigures figures =
        sim::truth_figures(truth, calib::load_calibration(calibration), around);
    fmt::print(
        "True 3-D error of the TCP [mm], after a 6-DoF alignment   (hidden from the estimator)\n"
        "  {:<34} {:>17}   {:>17}   {:>7}\n  {:<34} {:>8} {:>8}   {:>8} {:>8}   {:>7}\n",
        "", "nominal model", "calibrated", "within", "", "mean", "max", "mean", "max", "u95");
    print(fmt::format("within 150 mm of the spheres ({})", figures.local.poses).c_str(),
          figures.local);
    print(fmt::format("whole workspace ({} poses)", figures.workspace.poses).c_str(),
          figures.workspace);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "cellcal-truth: %s\n", e.what());
    return 1;
  }
}
