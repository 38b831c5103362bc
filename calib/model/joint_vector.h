#pragma once

#include <cstddef>
#include <vector>

namespace cellcal::calib {

/// The controller's axis positions, base to flange: angles [rad], of a linear unit [m].
using JointVector = std::vector<double>;

/// Point of the straight move between both, `share` of the way.
inline JointVector interpolated(const JointVector& from, const JointVector& to, double share) {
  JointVector q(from);
  for (std::size_t i = 0; i < q.size(); ++i) q[i] += share * (to[i] - from[i]);
  return q;
}

}  // namespace cellcal::calib
