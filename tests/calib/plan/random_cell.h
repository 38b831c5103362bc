#pragma once
// A random cell: a shipped robot, a tool in proportion, spheres on posts within reach, and random
// furniture.

#include <string>

#include "tests/calib/plan/collisions.h"

namespace cellcal::calib::testing {

struct RandomCell {
  Cell cell;
  std::string robot;  ///< file name
};

/// Deterministic for a seed. `robots`: the directory of robot files.
RandomCell random_cell(const std::string& robots, unsigned seed);

}  // namespace cellcal::calib::testing
