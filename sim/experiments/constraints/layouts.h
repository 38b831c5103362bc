#pragma once
// The cells that are compared: the same arm and tool, another kind of target in each.

#include <string>
#include <vector>

#include "calib/model/robot.h"

namespace cellcal::sim::constraints {

struct Layout {
  std::string name;
  calib::Cell cell;
  bool measures_length = false;  ///< beyond a sphere's own size: certified distances, wire, tracker
};

/// `base`: robot, tool and noise; its targets are replaced.
std::vector<Layout> layouts(const calib::Cell& base);

}  // namespace cellcal::sim::constraints
