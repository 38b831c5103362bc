#pragma once
// Play that the load closes: asked for behind the estimate without it.

#include "calib/estimate/estimate.h"
#include "calib/estimate/options.h"
#include "calib/problem/problem.h"

namespace cellcal::calib {

/// The estimate of `played`, an arm that has play, from that of `plain`, the same arm without, at
/// which `e` is: true and `e` moved there, where the touches make play likelier than it was
/// beforehand; else nothing changes. Touches repeat as weigh_repeats() has said of both.
bool estimate_with_play(const Problem& plain, Problem& played, const IdentifyOptions& options,
                        Estimate& e);

}  // namespace cellcal::calib
