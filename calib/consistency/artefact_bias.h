#pragma once
// What the touches of a sphere or the readings of a wire have in common beyond what the model gives
// them: a diameter that is not what the cell file states, an encoder that was zeroed elsewhere. The
// estimate bends the arm and moves the target for a few tenths of a millimetre, chi^2 hardly rises,
// and nothing else tells.

#include <vector>

#include "calib/consistency/leave_one_out.h"
#include "calib/estimate/estimate.h"
#include "calib/model/touch.h"
#include "calib/problem/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Of each sphere and wire with touches in use, in the order of the problem's blocks: how much
/// larger its radius, or longer its readings, had to be by all touches, certified lengths and
/// tolerances; and of all wires together, where there are several, which are of one instrument.
/// From the linearisation, without solving anew. `chi2`, `dof`: of the touches; where they scatter
/// more than stated they say less.
std::vector<ArtefactBias> artefact_biases(const Problem& problem, const Estimate& estimate,
                                          const NormalEquations& touches, double chi2, double dof);

/// By how many sigmas it is not what the cell file states.
double contradiction(const ArtefactBias& bias);
/// The most contradicted one of those beyond chance and what the model lacks; null where none is.
const ArtefactBias* worst_contradicted(const std::vector<ArtefactBias>& biases);

/// The session with that bias put right.
struct PutRight {
  Cell cell;
  std::vector<Touch> touches;
};
PutRight put_right(const Cell& cell, const std::vector<Touch>& touches, const ArtefactBias& bias);

bool is_of_sphere(const Cell& cell, const ArtefactBias& bias);

}  // namespace cellcal::calib
