#pragma once
// A way by sampling, for where the simple ones fail (route.h): two trees of straight joint-space
// moves grow from both ends until they meet (RRT-Connect, by OMPL). Slow, bounded in effort, and
// not sure to find what there is.

#include <optional>
#include <vector>

#include "calib/plan/collision/clearance.h"

namespace cellcal::calib {

struct DetourOptions {
  double tip_margin_m = 0.0;
  double limit_margin_rad = 0.0;  ///< an end that lies beyond it stays where it is
  int most_steps = 4000;          ///< of the trees; each costs a look at a move or two
  unsigned seed = 1;
};

struct Detour {
  std::vector<JointVector> way;  ///< waypoints from `from` (not among them) to `to`; empty: none
  int steps = 0;                 ///< that it took
};

/// Both ends must be clear. Every move of the way was found clear by `clearance`, and corners that
/// are not needed are cut. The same for the same input.
Detour find_detour(const Robot& robot, const Clearance& clearance, const JointVector& from,
                   const JointVector& to, const DetourOptions& options);

}  // namespace cellcal::calib
