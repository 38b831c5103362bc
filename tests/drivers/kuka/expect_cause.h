#pragma once
// Comparison of causes: the kind first, then each number of its evidence.

#include <gtest/gtest.h>

#include <cmath>
#include <type_traits>
#include <variant>
#include <vector>

#include "drivers/kuka/moves/cause.h"

namespace cellcal::drivers {

/// The evidence of one kind in the order of its fields.
template <class Kind>
std::vector<double> numbers(const Kind& kind) {
  if constexpr (std::is_empty_v<Kind>) {
    return {};
  } else if constexpr (requires { Kind{{}, {}, {}, {}}; }) {
    const auto& [a, b, c, d] = kind;
    return {static_cast<double>(a), static_cast<double>(b), static_cast<double>(c),
            static_cast<double>(d)};
  } else if constexpr (requires { Kind{{}, {}, {}}; }) {
    const auto& [a, b, c] = kind;
    return {static_cast<double>(a), static_cast<double>(b), static_cast<double>(c)};
  } else if constexpr (requires { Kind{{}, {}}; }) {
    const auto& [a, b] = kind;
    return {static_cast<double>(a), static_cast<double>(b)};
  } else {
    const auto& [a] = kind;
    return {static_cast<double>(a)};
  }
}

inline std::vector<double> numbers(const Cause& cause) {
  return std::visit([](const auto& kind) { return numbers(kind); }, cause);
}

inline void expect_cause(const Cause& cause, const Cause& expected, double within = 1e-9) {
  CoreResult shown;
  shown.cause = cause;
  ASSERT_EQ(cause.index(), expected.index()) << "it says: " << words(shown);
  const std::vector<double> has = numbers(cause), wants = numbers(expected);
  for (std::size_t i = 0; i < has.size(); ++i) {
    if (std::isfinite(wants[i])) {
      EXPECT_NEAR(has[i], wants[i], within) << words(shown);
    } else {
      EXPECT_EQ(std::isnan(has[i]), std::isnan(wants[i])) << words(shown);
    }
  }
}

}  // namespace cellcal::drivers
