#pragma once

#include <vector>

namespace cellcal::calib {

/// The controller's axis angles [rad], base to flange.
using JointVector = std::vector<double>;

}  // namespace cellcal::calib
