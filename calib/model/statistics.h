#pragma once
// Of normal numbers, and of likelihoods that are kept as logarithms.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

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

/// Of normal numbers with a sigma of 1 half are nearer to zero than this.
inline constexpr double kNormalMedian = 0.6745;
/// One over it: sigma of normal numbers from the median of their distances from the middle.
inline constexpr double kMadToSigma = 1.4826;

/// The middle one; of an even number the upper of the two. There must be one.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Of an even number the mean of the two in the middle, as tables of results have it; of none not a
/// number.
inline double median_between(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const double upper = median(values);
  if (values.size() % 2 == 1) return upper;
  std::nth_element(values.begin(),
                   values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2 - 1),
                   values.end());
  return (values[values.size() / 2 - 1] + upper) / 2.0;
}

}  // namespace cellcal::calib
