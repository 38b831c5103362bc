#include "calib/plan/reach/corners.h"

#include "calib/model/long_work.h"
#include "calib/plan/reach/candidates.h"

namespace cellcal::calib {

void round_corners(const Clearance& clearance, const JointVector& before, const JointVector& from,
                   PlannedTouch& touch) {
  touch.leaving = {};
  touch.corners.clear();
  if (touch.transit.empty()) return;
  if (!before.empty())
    touch.leaving = clearance.corner(before, from, touch.transit.front(), kTipMarginM);
  for (std::size_t i = 0; i < touch.transit.size(); ++i) {
    poll_cancelled();
    const JointVector& last = i == 0 ? from : touch.transit[i - 1];
    const JointVector& next = i + 1 < touch.transit.size() ? touch.transit[i + 1] : touch.end;
    touch.corners.push_back(clearance.corner(last, touch.transit[i], next, kTipMarginM));
  }
}

}  // namespace cellcal::calib
