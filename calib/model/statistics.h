#pragma once
// Statistics of normal variables, and of likelihoods kept as logarithms.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

namespace cellcal::calib {

/// Probability that a standard normal variable exceeds z.
inline double normal_above(double z) { return 0.5 * std::erfc(z / std::numbers::sqrt2); }

/// Logarithm of the sum of exponentials; minus infinity for an empty span.
inline double log_sum(std::span<const double> logs) {
  if (logs.empty()) return -std::numeric_limits<double>::infinity();
  const double most = *std::max_element(logs.begin(), logs.end());
  double sum = 0.0;
  for (const double one : logs) sum += std::exp(one - most);
  return most + std::log(sum);
}

/// Median of the absolute value of a standard normal variable.
inline constexpr double kNormalMedian = 0.6745;
/// Its inverse: sigma of normal variables per median absolute deviation.
inline constexpr double kMadToSigma = 1.4826;

/// Median; the upper of the two middle values for an even count. Requires at least one value.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Median as in result tables: mean of the two middle values for an even count, NaN for none.
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
