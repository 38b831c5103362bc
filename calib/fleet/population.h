#pragma once
// Which arms are one population: each once, without those that are too far off, or too near the nominal geometry.

#include <vector>

#include "calib/fleet/spreads.h"

namespace cellcal::calib {

struct Population {
  SpreadFit spreads;
  std::vector<bool> use;
  std::vector<double> chi2, far;  ///< of all arms by the spreads of most, and as a normal deviate
  std::vector<std::size_t> same_as;  ///< the arm that it is; its own index: it counts itself
};

Population population_of(const std::vector<ArmRows>& arms, const Groups& groups);

}  // namespace cellcal::calib
