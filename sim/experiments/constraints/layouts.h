#pragma once
// Cells to be compared: the same arm and tool, with a different kind of target in each.

#include <string>
#include <vector>

#include "calib/model/robot.h"

namespace cellcal::sim::constraints {

struct Layout {
  std::string name;
  calib::Cell cell;
  bool measures_length = false;  ///< certified distances, wire, tracker; not a sphere's size
};

/// `base`: robot, tool and noise; its targets are replaced.
std::vector<Layout> layouts(const calib::Cell& base);

}  // namespace cellcal::sim::constraints
