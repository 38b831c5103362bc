#include "calib/model/robot.h"

#include <stdexcept>

namespace cellcal::calib {

std::size_t Cell::target_index(const std::string& id) const {
  for (std::size_t i = 0; i < targets.size(); ++i)
    if (targets[i].id == id) return i;
  throw std::out_of_range("no target \"" + id + "\" in the cell");
}

}  // namespace cellcal::calib
