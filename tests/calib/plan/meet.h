#pragma once
// Contact of a true arm with a true sphere on its search line.

#include <optional>

#include "calib/model/linear.h"
#include "calib/plan/planned_touch.h"
#include "sim/cell/truth.h"

namespace cellcal::calib::testing {

struct Met {
  Touch touch;
  double travel_m = 0.0;  ///< from the stand-off
};

/// With 0.03 mm of noise; empty without contact.
inline std::optional<Met> meet(const Cell& cell, const sim::Truth& truth,
                               const PlannedTouch& planned, Random& random) {
  const std::size_t target = cell.target_index(planned.target);
  const double radius = truth.radius_m[target] + 3e-5 * random.normal();
  const auto gap = [&](double share) {
    JointVector q(planned.standoff.size());
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] = planned.standoff[i] + share * (planned.end[i] - planned.standoff[i]);
    const double distance =
        (truth.arm.position(truth.arm.prepare(q), truth.errors.data()) - truth.centre_m[target])
            .norm();
    return std::pair(distance - radius, q);
  };
  double out = 0.0, in = 1.0;
  if (gap(out).first < 0.0 || gap(in).first > 0.0) return std::nullopt;
  constexpr int kHalvings = 40;
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = (out + in) / 2.0;
    (gap(middle).first > 0.0 ? out : in) = middle;
  }
  Met met;
  met.touch.target = planned.target;
  met.touch.joint_rad = gap(in).second;
  met.travel_m = in * planned.search_m;
  return met;
}

}  // namespace cellcal::calib::testing
