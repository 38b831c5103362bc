#pragma once
// Targets that may have been knocked or have crept during the session, from the linearisation: no
// more than reasons to look closer (calib/diagnose/jump.h).

#include <vector>

#include "calib/estimate/estimate.h"
#include "calib/problem/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// What is looked for, 1 sigma in each direction. What a touch or two leave open is not filled with
/// moves of centimetres, which nobody would overlook.
constexpr double kUsualMoveM = 1e-3;

/// Targets, each with the touch of it that speaks most for a move after it, loudest first; from the
/// linearisation, without solving anew. No more than reasons to look closer.
std::vector<MovedTarget> suspected_moves(const Problem& problem, const Estimate& estimate,
                                         double chi2_per_dof);

}  // namespace cellcal::calib
