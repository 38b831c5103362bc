#pragma once
// A joint or the tool that may have jumped in the middle of the session, from the linearisation: no
// more than a reason to look closer (calib/diagnose/jump.h).

#include <vector>

#include "calib/estimate/estimate.h"
#include "calib/problem/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// The joint or the tool whose jump would improve the fit most, and after which touch about; none
/// where it is no more than chance. From the linearisation, without solving anew: a reason to look
/// closer, no more.
std::vector<Jump> suspected_jump(const Problem& problem, const Estimate& estimate,
                                 double chi2_per_dof);

}  // namespace cellcal::calib
