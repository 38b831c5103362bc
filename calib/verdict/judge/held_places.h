#pragma once
// Whether the touches of each target hold its place, and which readings hold the scale of the arm:
// a tracker measures lengths itself, and so does a wire.

#include <string>
#include <vector>

#include "calib/problem/problem.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

struct HeldPlaces {
  std::vector<int> loose;       ///< blocks whose touches do not hold their place
  int trackers = 0, wires = 0;  ///< whose readings hold the scale
  /// The last of these; null: none.
  const Target* rule = nullptr;
};

/// Says of each loose target from where it is to be touched.
HeldPlaces judge_places(const Problem& problem, const Calibration& c,
                        std::vector<Finding>& findings);

}  // namespace cellcal::calib
