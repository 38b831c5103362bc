#pragma once
// What touches, tolerances and the other lengths say of each certified length, that length itself
// left out. A length that is certified to microns is held whatever the touches say, so that its own
// residual tells nothing; what the others foresee does (Baarda's data snooping).

#include <vector>

#include "calib/identify/calibration.h"
#include "calib/identify/estimate.h"
#include "calib/identify/problem.h"

namespace cellcal::calib {

/// Of all lengths whose both ends were touched, in the order of the cell file. From the
/// linearisation, without solving anew. `inflation`: of variances, where touches scatter more than
/// stated.
std::vector<LengthResult> lengths_by_others(const Problem& problem, const Estimate& estimate,
                                            double inflation);

/// By how many sigmas of both the others contradict a length.
double contradiction(const LengthResult& length);
/// Further than chance and what the model lacks: over arms with gears of every form in
/// tests/experiments none of some thousand lengths was contradicted by more than 3 sigmas.
bool is_contradicted(const LengthResult& length);
/// The most contradicted one; null where none is.
const LengthResult* worst_contradicted(const std::vector<LengthResult>& lengths);

}  // namespace cellcal::calib
