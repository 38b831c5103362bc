#pragma once
// Parts of the arm's model by evidence: compliance of the joints across their axes, and transmission
// errors as random functions of each joint's own angle. An arm has them only if the touches show
// them. The functions are Fourier series whose coefficients have the variances of a Matern-3/2
// kernel (calib/model/README.md), so that they are unknowns as any other of the arm.

#include <optional>

#include "calib/estimate/estimate.h"
#include "calib/estimate/repeats.h"

namespace cellcal::calib {

/// The cell, its joints with the bearings and functions of that robot.
Cell with_learnt_of(const Robot& robot, Cell cell);

/// Joints compliant across their axes; `share` of the prior of the compliance about the axis, of a
/// joint without one (A1 of an upright arm bears no torque) that of the next joint that has one.
Robot with_bearings(Robot robot, double share);
/// True if residuals of touches that `richer` correlates are correlated, (30). `e`: the estimate of
/// `plain`, which lacks the additional unknowns of `richer`.
bool speaks_for(const Problem& plain, Problem& richer, const Estimate& e);

/// True if a joint has a function of its angle or single waves.
bool has_functions(const Robot& robot);

/// The robot with the sizes and the reach of its joints' functions by restricted likelihood; none
/// where the residuals of touches that share joint angles are uncorrelated, (30). `e`: the estimate
/// of `problem`, which lacks functions.
std::optional<Robot> size_functions(const Problem& problem, const Repeats& repeats,
                                    const Estimate& e);

/// The robot with fast orders in the functions that show them; none where no function does. `e`: the
/// estimate of `problem`, every joint of which has a function.
std::optional<Robot> size_fast_orders(const Problem& problem, const Repeats& repeats,
                                      const Estimate& e);

/// log evidence of `richer` minus that of `plain`, whose estimate `e` is, at the likely levels.
double evidence_gain(const Problem& plain, Problem& richer, const Estimate& e);

/// The estimate of `richer`, from that of `plain`. Throws IdentifyError.
Estimate estimate_richer(const Problem& plain, Problem& richer, const IdentifyOptions& options,
                         const std::vector<ModelLevel>& levels, const Estimate& e);

}  // namespace cellcal::calib
