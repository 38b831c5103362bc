#pragma once
// Shortens the search line of a touch by the current estimate of the arm; on nominal geometry it
// must allow for errors of millimetres.

#include <functional>

#include "calib/estimate/incremental_estimate.h"
#include "calib/plan/pool.h"

namespace cellcal::calib {

struct Known {
  const Pool& pool;
  const IncrementalEstimate& estimate;
  const PlanOptions& options;
  double sigma_m;  ///< of the expected contact along the line
};

/// Shortens the touch's search if the uncertainty allows it and the shorter line is clear: the
/// transit is extended from the default stand-off to one nearer to the surface.
void aim(const Known& known, const Candidate& candidate, PlannedTouch& touch);

/// Contact of a candidate with the estimated arm. Base frame.
struct Surface {
  Eigen::Vector3d centre_m, normal;  ///< at contact the tip is at centre + radius normal
  double radius_m;
  std::function<Eigen::Vector3d(const JointVector&)> tip_m;
};
/// Tip path before and after the contact.
struct SearchLength {
  double before_m, behind_m;
};
/// As above with the given search length; returns false without effect if it is not clear or out of reach.
bool aim_at(const Pool& pool, const PlanOptions& options, const Surface& surface,
            const SearchLength& length, const Candidate& candidate, PlannedTouch& touch);

}  // namespace cellcal::calib
