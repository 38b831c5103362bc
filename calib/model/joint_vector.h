#pragma once

#include <vector>

namespace cellcal::calib {

/// The controller's axis positions, base to flange: angles [rad], of a linear unit [m].
using JointVector = std::vector<double>;

}  // namespace cellcal::calib
