#pragma once
// A plan looked at from outside.

#include <functional>
#include <vector>

#include "calib/model/kinematics.h"
#include "calib/plan/plan.h"

namespace cellcal::calib::testing {

/// The nominal arm; only tips of it are asked for.
ArmModel nominal_arm(const Cell& cell);

/// Smallest distance of the tip from any sphere's surface [m].
double gap_m(const Cell& cell, const ArmModel& arm, const JointVector& q);

/// Calls `look` at every pose of the straight joint-space way, so finely that the tip moves less
/// than half a millimetre in between.
void along(const ArmModel& arm, const JointVector& from, const JointVector& to,
           const std::function<void(const JointVector&)>& look);

/// The smallest gap on the way over all waypoints.
double smallest_gap_m(const Cell& cell, const ArmModel& arm, const JointVector& from,
                      const std::vector<JointVector>& waypoints);

/// Posture in the middle of the limits between `a` and `b`.
JointVector between(const JointVector& a, const JointVector& b, double share);

}  // namespace cellcal::calib::testing
