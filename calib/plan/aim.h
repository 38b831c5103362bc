#pragma once
// The search line of a touch with the arm as the touches so far know it: shorter than on nominal
// geometry, where an arm is off by millimetres.

#include <functional>

#include "calib/estimate/incremental_estimate.h"
#include "calib/plan/pool.h"

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

/// Where a candidate's contact is, by an arm that is known. Base frame.
struct Surface {
  Eigen::Vector3d centre_m, normal;  ///< contact where the tip is at centre + radius normal
  double radius_m;
  std::function<Eigen::Vector3d(const JointVector&)> tip_m;
};
/// Tip path before and behind the contact.
struct SearchLength {
  double before_m, behind_m;
};
/// The same with a search of that length; false, and nothing is done, where it is not clear or out of reach.
bool aim_at(const Pool& pool, const PlanOptions& options, const Surface& surface,
            const SearchLength& length, const Candidate& candidate, PlannedTouch& touch);

}  // namespace cellcal::calib
