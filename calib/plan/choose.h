#pragma once
// Which candidates to touch: greedy I-optimal choice. Each pick is the touch that takes most from
// the mean predicted position variance over the workspace; the posterior is updated by rank one.

#include <vector>

#include "calib/plan/candidates.h"

namespace cellcal::calib {

struct Choice {
  std::vector<std::size_t> picked;  ///< indices into the candidates, in order of worth
  double predicted_m3_m = 0.0;      ///< mean 3-D error over the workspace after these touches
};

/// `least_per_target`: every sphere gets at least this many.
Choice choose(const Cell& cell, const std::vector<Candidate>& candidates, int count,
              int least_per_target);

}  // namespace cellcal::calib
