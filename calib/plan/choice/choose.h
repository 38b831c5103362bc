#pragma once
// Which candidates to touch.

#include <functional>
#include <vector>

#include "calib/plan/reach/accuracy_region.h"
#include "calib/plan/reach/candidates.h"

namespace cellcal::calib {

struct ChooseOptions {
  int count = 40;
  int least_per_target = 5;  ///< every sphere gets at least this many
  Criterion criterion = Criterion::kI;
  AccuracyRegion region;  ///< where accuracy matters
  int exchanges = 2;      ///< rounds at most in which each touch may be exchanged for a better one
  unsigned seed = 1;      ///< of a random choice
  std::vector<std::size_t> start;  ///< picked already, possible; may be exchanged
  /// Asked of a candidate before it is picked, at most once: whether it can be made. Null: all can.
  std::function<bool(std::size_t)> possible;
};

struct Choice {
  std::vector<std::size_t> picked;  ///< indices into the candidates
  double predicted_mean_m = 0.0;    ///< mean 3-D error over the region after these touches
  double reducible_m = 0.0;         ///< of it, what further touches could take away
  /// Mean over the region of the radius that holds it at 95 % (bound.h); 0 of the tool's region.
  double predicted_u95_m = 0.0;
};

/// Fewer than `count` where no more are possible.
Choice choose(const Cell& cell, const std::vector<Candidate>& candidates,
              const ChooseOptions& options);

}  // namespace cellcal::calib
