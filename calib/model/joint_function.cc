#include "calib/model/joint_function.h"

#include <cmath>
#include <numbers>

namespace cellcal::calib {

/// (2a): the variances of the orders add up to that of the function.
std::vector<double> function_shares(double reach_rad, int lowest, int highest) {
  const double edge = std::numbers::sqrt3 / reach_rad;
  std::vector<double> shares;
  double sum = 0.0;
  for (int order = lowest; order <= highest; ++order) {
    shares.push_back(1.0 / (edge * edge + order * order));
    sum += std::pow(shares.back(), 2);
  }
  for (double& share : shares) share /= std::sqrt(sum);
  return shares;
}

}  // namespace cellcal::calib
