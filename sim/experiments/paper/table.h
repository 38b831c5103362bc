#pragma once
// The three columns: published, the paper's estimator rerun, cellcal.

#include <string>

#include "sim/experiments/paper/figures.h"

namespace cellcal::sim::paper {

/// Medians over several random placements of the touches.
struct Placings {
  int count = 0;
  double paper_simulation_m = 0.0, ours_simulation_m = 0.0;  ///< mean 3-D error in the workspace
  double paper_experiment_m = 0.0, ours_experiment_m = 0.0;
};

/// Both tasks in adjacent columns, the paper's estimator at other values of lambda, and the
/// published figures that are not reproduced.
std::string comparison(const Solved& simulation, const Solved& experiment,
                       const Placings& placings);

}  // namespace cellcal::sim::paper
