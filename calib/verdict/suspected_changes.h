#pragma once
// Targets, a joint or the tool that may have moved or jumped during the session: by the score test,
// without solving anew. No more than reasons to look closer (calib/identify/jump.h).

#include <vector>

#include "calib/estimate/estimate.h"
#include "calib/estimate/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Targets that may have been knocked or have crept, each with the touch of it that speaks most for
/// a move after it, loudest first.
std::vector<MovedTarget> suspected_moves(const Problem& problem, const Estimate& estimate,
                                         double chi2_per_dof);

/// The joint or the tool whose jump would improve the fit most, and after which touch about; none
/// where it is no more than chance.
std::vector<Jump> suspected_jump(const Problem& problem, const Estimate& estimate,
                                 double chi2_per_dof);

}  // namespace cellcal::calib
