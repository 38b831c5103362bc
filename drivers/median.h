#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

namespace cellcal::drivers {

/// Median; the upper of the two middle values for an even count. Requires at least one value.
/// Changes their order.
template <class T>
T median_of(std::span<T> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace cellcal::drivers
