#pragma once
// One value that a Sparkplug node tells of.

#include <cstdint>
#include <string>
#include <variant>

namespace cellcal::daemon::plant::sparkplug {

/// By the standard's numbers.
enum class DataType : std::uint32_t {
  kInt64 = 4,
  kDouble = 10,
  kBoolean = 11,
  kString = 12,
  kDateTime = 13
};

struct Metric {
  std::string name;
  DataType type = DataType::kInt64;
  /// Nothing: not known. DateTime is ms since 1970, UTC, as std::int64_t.
  std::variant<std::monostate, std::int64_t, double, bool, std::string> value{};

  bool operator==(const Metric&) const = default;
};

}  // namespace cellcal::daemon::plant::sparkplug
