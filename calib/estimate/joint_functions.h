#pragma once
// Transmission errors as random functions of each joint's own angle, beside geometry, compliance and
// the smooth part: theirs are the covariances that touches which share a joint angle have in common.
// Fourier series whose coefficients have the variances of a Matern-3/2 kernel (calib/model/README.md),
// so that they are unknowns as any other of the arm.

#include <optional>

#include "calib/estimate/estimate.h"
#include "calib/estimate/repeats.h"

namespace cellcal::calib {

/// The cell, its joints with the functions of that robot.
Cell with_functions_of(const Robot& robot, Cell cell);

/// The robot with the sizes and the reach of its joints' functions by restricted likelihood; none
/// where the residuals of touches that share joint angles are not alike. `reference`: the problem
/// whose joints have functions of any size, `e` the estimate of `plain`, which has none.
std::optional<Robot> with_functions(const Problem& plain, const Problem& reference,
                                    const Repeats& repeats, const Estimate& e);

/// Joints that all have one: what with_functions() asks for.
Robot with_reference_functions(Robot robot);

/// The estimate of `richer`, an arm with functions, from that of `plain`, the same without, at which
/// `e` is: true and `e` moved there, where its evidence is the greater; else nothing changes.
bool estimate_with_functions(const Problem& plain, Problem& richer, const IdentifyOptions& options,
                             bool with_play, Estimate& e);

}  // namespace cellcal::calib
