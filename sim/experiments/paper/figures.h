#pragma once
// The paper's Figures 6, 7, 8 and 11, drawn from a run.

#include <filesystem>
#include <string>
#include <vector>

#include "calib/result/calibration.h"
#include "sim/experiments/paper/task.h"

namespace cellcal::sim::paper {

/// One task and the results of both estimators.
struct Solved {
  Task task;
  calib::Calibration paper, ours;
  std::vector<double> paper_mean_m;  ///< mean of Eq. 39 over the fit touches, per iteration
  std::vector<double> ours_mean_m;
};

struct Figure {
  std::string file;  ///< "figure-6.svg"
  std::string caption;
  std::string svg;
};

std::vector<Figure> make_figures(const Solved& simulation, const Solved& experiment);

/// Writes each figure, and figures.html with all of them and the plain text `table`. Throws
/// std::runtime_error naming a file that cannot be written.
void write_figures(const std::vector<Figure>& figures, const std::string& table,
                   const std::filesystem::path& folder);

}  // namespace cellcal::sim::paper
