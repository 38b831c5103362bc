#pragma once
// Targets, a joint or the tool that may have moved or jumped during the session: by the score test,
// without another solution. Candidates for examination only (calib/identify/jump.h).

#include <vector>

#include "calib/estimate/estimate.h"
#include "calib/estimate/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Targets that may have been displaced or have crept, each with its most likely last touch before
/// the move, in descending order of evidence.
std::vector<MovedTarget> suspected_moves(const Problem& problem, const Estimate& estimate,
                                         double chi2_per_dof);

/// The joint or the tool whose jump would improve the fit most, and the approximate touch before
/// it; empty within chance.
std::vector<Jump> suspected_jump(const Problem& problem, const Estimate& estimate,
                                 double chi2_per_dof);

}  // namespace cellcal::calib
