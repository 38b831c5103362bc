#pragma once
// Of normal numbers, and of likelihoods that are kept as logarithms.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

namespace cellcal::calib {

/// The probability that a normal number is above z sigma.
inline double normal_above(double z) { return 0.5 * std::erfc(z / std::numbers::sqrt2); }

/// The logarithm of the sum of what these are the logarithms of; minus infinity of none.
inline double log_sum(std::span<const double> logs) {
  if (logs.empty()) return -std::numeric_limits<double>::infinity();
  const double most = *std::max_element(logs.begin(), logs.end());
  double sum = 0.0;
  for (const double one : logs) sum += std::exp(one - most);
  return most + std::log(sum);
}

}  // namespace cellcal::calib
