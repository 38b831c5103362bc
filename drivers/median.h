#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

namespace cellcal::drivers {

/// The middle one; of an even number the upper of the two. There must be one. Changes their order.
template <class T>
T median_of(std::span<T> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace cellcal::drivers
