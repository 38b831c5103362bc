#pragma once
// What the touches of a sphere or the readings of a wire have in common beyond what the model gives
// them: a diameter that is not what the cell file states, an encoder that was zeroed elsewhere. The
// estimate bends the arm and moves the target for a few tenths of a millimetre, chi^2 hardly rises,
// and nothing else tells.

#include <functional>
#include <vector>

#include "calib/estimate/estimate.h"
#include "calib/estimate/problem.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"
#include "calib/verdict/leave_one_out.h"

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

// What touches, tolerances and the other lengths say of each certified length, that length itself
// left out. A length that is certified to microns is held whatever the touches say, so that its own
// residual tells nothing; what the others foresee does (Baarda's data snooping).

/// Of all lengths whose both ends were touched, in the order of the cell file; lengths between the
/// same two ends are left out together. From the linearisation. `chi2`, `dof`: of the touches;
/// where they scatter more than stated the others say less.
std::vector<LengthResult> leave_one_out_lengths(const Problem& problem, const Estimate& estimate,
                                                const NormalEquations& touches, double chi2,
                                                double dof);

/// By how many sigmas of both the others contradict a length.
double contradiction(const LengthResult& length);
/// By more than five sigmas: further than chance and what the model lacks.
bool is_contradicted(const LengthResult& length);
/// The least error of a length that the others would contradict [m].
double least_seen_error_m(const LengthResult& length);
/// Between the same two targets, whichever is named first.
bool same_ends(const LengthResult& a, const LengthResult& b);
/// The most contradicted one; null where none is.
const LengthResult* worst_contradicted(const std::vector<LengthResult>& lengths);

bool same_ends(const CertifiedLength& a, const CertifiedLength& b);
bool is_of(const LengthResult& result, const CertifiedLength& length);
/// With lengths that say nothing, these or all: what all else says of them is still worked out.
Cell silenced(Cell cell, const std::function<bool(const CertifiedLength&)>& which = {});

}  // namespace cellcal::calib
