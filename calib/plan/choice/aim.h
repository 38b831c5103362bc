#pragma once
// The search line of a touch with the arm as the touches so far know it: shorter than on nominal
// geometry, where an arm is off by millimetres.

#include "calib/estimate/incremental_estimate.h"
#include "calib/plan/reach/pool.h"

namespace cellcal::calib {

struct Known {
  const Pool& pool;
  const IncrementalEstimate& estimate;
  const PlanOptions& options;
  double sigma_m;  ///< of the place along the line where contact is expected
};

/// Shortens the touch's search where what is known allows it and the shorter line is clear: the
/// transit goes on from the usual stand-off to one nearer to the surface.
void aim(const Known& known, const Candidate& candidate, PlannedTouch& touch);

}  // namespace cellcal::calib
