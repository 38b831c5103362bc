#pragma once
// External view of a plan.

#include <functional>
#include <vector>

#include "calib/model/kinematics.h"
#include "calib/plan/plan.h"

namespace cellcal::calib::testing {

/// The nominal arm; used for tips only.
ArmModel nominal_arm(const Cell& cell);

/// Smallest distance of the tip from any sphere's surface [m].
double gap_m(const Cell& cell, const ArmModel& arm, const JointVector& q);

/// Calls `visit` at every pose of the straight joint-space move, in steps of less than half a
/// millimetre of the tip.
void along(const ArmModel& arm, const JointVector& from, const JointVector& to,
           const std::function<void(const JointVector&)>& visit);

/// The smallest gap on the path over all waypoints.
double smallest_gap_m(const Cell& cell, const ArmModel& arm, const JointVector& from,
                      const std::vector<JointVector>& waypoints);

/// Posture between `a` and `b` at this share.
JointVector between(const JointVector& a, const JointVector& b, double share);

}  // namespace cellcal::calib::testing
