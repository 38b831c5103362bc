#pragma once
// Runs both estimators on a task and records how they converge.

#include "sim/experiments/paper/figures.h"
#include "sim/experiments/paper/table.h"

namespace cellcal::sim::paper {

/// Throws calib::IdentifyError.
Solved solve(const Task& task);

/// Both tasks with seeds 1 to `count`: what the figures are apart from one lucky placing.
Placings solve_placings(int count);

}  // namespace cellcal::sim::paper
