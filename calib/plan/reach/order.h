#pragma once
// The order of visits that costs the robot the least time, near enough: an open path from a start.

#include <Eigen/Core>
#include <vector>

namespace cellcal::calib {

/// `cost(i, j)`: from i to j, any non-negative times; `from_start[i]`: to i first. Nearest
/// neighbour, then 2-opt and or-opt moves until none helps. The same for the same costs.
std::vector<std::size_t> short_order(const Eigen::MatrixXd& cost,
                                     const Eigen::VectorXd& from_start);

}  // namespace cellcal::calib
