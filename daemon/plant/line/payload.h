#pragma once
// Serialisation of Sparkplug B payloads; encapsulates Protobuf.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace cellcal::daemon::plant::sparkplug {

// One value of a Sparkplug node.

/// Numbers of the standard.
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
  /// monostate: unknown. DateTime is ms since 1970, UTC, as std::int64_t.
  std::variant<std::monostate, std::int64_t, double, bool, std::string> value{};

  bool operator==(const Metric&) const = default;
};

/// Metrics of a birth include their types, those of data messages do not: the host knows them.
enum class Types { kDeclared, kKnown };
/// `time_ms`: since 1970, UTC. `seq`: none in an NDEATH.
std::string payload(const std::vector<Metric>& metrics, std::uint64_t time_ms,
                    std::optional<std::uint8_t> seq, Types types);

inline constexpr const char* kRebirth = "Node Control/Rebirth";
/// True if a command requests a new birth. The sender is unverified: an invalid payload requests nothing.
bool asks_for_rebirth(std::string_view command);

}  // namespace cellcal::daemon::plant::sparkplug
