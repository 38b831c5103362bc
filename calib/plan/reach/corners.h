#pragma once
// How far before and behind a way-point the arm may leave the legs that were found clear, so that it
// need not stop there.

#include "calib/plan/collision/clearance.h"
#include "calib/plan/reach/planned_touch.h"

namespace cellcal::calib {

/// Fills the touch's corners. `from`: where its transit begins; `before`: the farthest that the arm
/// may come from to there, on a straight line; empty: it begins at rest.
void round_corners(const Clearance& clearance, const JointVector& before, const JointVector& from,
                   PlannedTouch& touch);

}  // namespace cellcal::calib
