#pragma once
// How many more touches a goal takes, by how the last ones brought the bound down.

#include <utility>
#include <vector>

namespace cellcal::calib {

/// The model's own foresight holds all its levels to be as likely as now. Touches tell them apart,
/// and the bound then falls faster: as a power of their number, fitted to the last sixteen.
/// `bounds`: u95 [m] after so many touches. At least 1; `most` where there is nothing to go by.
int touches_by_trend(const std::vector<std::pair<int, double>>& bounds, double goal_m, int most);

}  // namespace cellcal::calib
