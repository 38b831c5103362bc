#pragma once
// A cell drawn at random: a shipped robot, a tool in proportion, spheres on stands within reach,
// and furniture wherever it falls.

#include <string>

#include "tests/calib/plan/collisions.h"

namespace cellcal::calib::testing {

struct RandomCell {
  Cell cell;
  std::string robot;  ///< file name
};

/// The same for the same seed. `robots`: the folder of robot files.
RandomCell random_cell(const std::string& robots, unsigned seed);

}  // namespace cellcal::calib::testing
