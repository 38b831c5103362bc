#pragma once
// Runs both estimators on a task and records their convergence.

#include "sim/experiments/paper/figures.h"
#include "sim/experiments/paper/table.h"

namespace cellcal::sim::paper {

/// Throws calib::IdentifyError.
Solved solve(const Task& task);

/// Both tasks with seeds 1 to `count`: figures independent of a single lucky placement.
Placings solve_placings(int count);

}  // namespace cellcal::sim::paper
