#pragma once
// The three columns: published, the paper's estimator rerun, cellcal.

#include <string>

#include "tests/experiments/paper/figures.h"

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

// Figures published in the paper (Wang et al., Appl. Sci. 2024, 14, 9824), in millimetres.

struct PublishedFigures {
  double before_mean_mm, before_max_mm;
  double after_mean_mm, after_max_mm;
};

/// Section 4.3 and Figure 8: simulation without noise, the 50 touches of the fit.
inline constexpr PublishedFigures kPublishedSimulation{3.657, 5.559, 0.665, 1.104};
/// Section 5.4 and Figure 11: the real robot, 30 touches not used for the fit.
inline constexpr PublishedFigures kPublishedExperiment{1.923, 4.715, 0.383, 1.153};
/// Section 4.2: "After 50 iterations, the data converged".
inline constexpr int kPublishedIterations = 50;
/// Section 5.4: c_t identified on the real robot, 1/(N m^2).
inline constexpr double kPublishedDeflection = 0.00036;

// Runs both estimators on a task and records their convergence.

/// Throws calib::IdentifyError.
Solved solve(const Task& task);

/// Both tasks with seeds 1 to `count`: figures independent of a single lucky placement.
Placings solve_placings(int count);

}  // namespace cellcal::sim::paper
