// Reruns the seed paper's simulation and the conditions of its experiment; see README.md.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <fstream>

#include "calib/files/files.h"
#include "tests/experiments/paper/figures.h"
#include "tests/experiments/paper/table.h"
#include "tests/experiments/paper/task.h"

namespace {

namespace paper = cellcal::sim::paper;

/// Upper bound of the noise-free check residual of cellcal's estimator [m].
constexpr double kGoalM = 1e-9;
/// Sufficient for a median that varies by about ten per cent between seeds.
constexpr int kPlacings = 20;

void write_touches(const paper::Task& task, const std::filesystem::path& path) {
  std::ofstream out(path, std::ios::binary);
  out << cellcal::calib::format_touches(task.touches, task.cell.robot);
  out.close();
  if (!out) throw std::runtime_error("cannot write " + path.string());
}

int run(unsigned seed, const std::filesystem::path& folder) {
  paper::Conditions conditions = paper::simulation_conditions();
  conditions.seed = seed;
  const paper::Solved simulation = paper::solve(paper::make_task(conditions));
  conditions = paper::experiment_conditions();
  conditions.seed = seed;
  const paper::Solved experiment = paper::solve(paper::make_task(conditions));

  const std::string table =
      paper::comparison(simulation, experiment, paper::solve_placings(kPlacings));
  fmt::print("{}", table);
  paper::write_figures(paper::make_figures(simulation, experiment), table, folder);
  write_touches(simulation.task, folder / "simulation-touches.csv");
  write_touches(experiment.task, folder / "experiment-touches.csv");
  fmt::print("\nFigures 6, 7, 8 and 11: {}\n", (folder / "figures.html").string());

  if (!(simulation.ours.check.max_m < kGoalM)) {
    fmt::print(stderr,
               "cellcal's noise-free check residual is {:.1e} mm; it has to stay below "
               "{:.0e} mm\n",
               simulation.ours.check.max_m * 1e3, kGoalM * 1e3);
    return 1;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Reruns the seed paper's simulation with its own estimator and with cellcal's.\n"
      "Example: sim/paper -o /tmp/figures");
  std::string folder = "paper-figures";
  unsigned seed = 1;
  app.add_option("-o,--output", folder, "folder for figures and touches")
      ->capture_default_str()
      ->take_last();  // sim/paper passes a default before the user's own
  app.add_option("--seed", seed, "seed of the touches and their noise")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    return run(seed, folder);
  } catch (const std::exception& problem) {
    fmt::print(stderr, "{}\n", problem.what());
    return 1;
  }
}
