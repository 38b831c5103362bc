// Compares a calibration with the truth of a seed.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "sim/cell/compare.h"
#include "sim/emulator/options.h"

namespace {

using namespace cellcal;

void print(const char* name, const sim::RegionFigures& f) {
  fmt::print("  {:<34} {:>8.3f} {:>8.3f}   {:>8.3f} {:>8.3f}   {:>5.1f} %\n", name,
             f.nominal_mean_m * 1e3, f.nominal_max_m * 1e3, f.mean_m * 1e3, f.max_m * 1e3,
             f.covered * 100.0);
}

std::string heading(const sim::Truth& truth) {
  return truth.growth > 0.0
             ? fmt::format("True 3-D error of the TCP [mm], the arm warmed up (+{:.0f} ppm)",
                           truth.growth * 1e6)
             : "True 3-D error of the TCP [mm]";
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
    const std::vector<calib::Touch> latched = calib::load_touches(touches, cell);
    std::vector<calib::JointVector> around;
    for (const calib::Touch& touch : latched) around.push_back(touch.joint_rad);
    const sim::SurfaceFigures off = sim::surface_figures(truth, latched);
    fmt::print(
        "Latched touches off the true surfaces [mm]: mean {:.4f}, max {:.4f} ({} touches{})\n",
        off.mean_m * 1e3, off.max_m * 1e3, latched.size(),
        off.bad > 0 ? fmt::format(", {} by more than {:.1f}", off.bad, sim::kBadM * 1e3) : "");
    if (calibration.empty()) return 0;
    const sim::TruthFigures figures =
        sim::truth_figures(truth, calib::load_calibration(calibration), around);
    fmt::print(
        "{}, after a 6-DoF alignment   (hidden from the estimator)\n"
        "  {:<34} {:>17}   {:>17}   {:>7}\n  {:<34} {:>8} {:>8}   {:>8} {:>8}   {:>7}\n",
        heading(truth), "", fmt::format("nominal ({})", sim::kNominalPoses), "calibrated", "within",
        "", "mean", "max", "mean", "max", "u95");
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
