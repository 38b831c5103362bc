#pragma once
// What touches, tolerances and the other lengths say of each certified length, that length itself
// left out. A length that is certified to microns is held whatever the touches say, so that its own
// residual tells nothing; what the others foresee does (Baarda's data snooping).

#include <functional>
#include <vector>

#include "calib/consistency/leave_one_out.h"
#include "calib/estimate/estimate.h"
#include "calib/problem/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

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
