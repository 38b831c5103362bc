#pragma once
// The cell as a Sparkplug B edge node on the plant's broker, on its own thread; callers never block.

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "daemon/config/network_config.h"
#include "daemon/plant/line/line_status.h"

namespace cellcal::daemon::plant::sparkplug {

// Serialisation of Sparkplug B payloads; encapsulates Protobuf.

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

class EdgeNode {
 public:
  struct Parts {
    PlantConfig config;
    /// State of the cell: always the same names in the same order; empty: not known yet. Called on this
    /// object's thread.
    std::function<std::vector<Metric>()> metrics;
    /// Polling period, and minimum interval of births on request.
    std::chrono::milliseconds every{1000};
    std::chrono::milliseconds first_wait{1000},
        longest_wait{60000};  ///< delay before a line is reopened
    std::chrono::milliseconds farewell{2000};
    std::chrono::seconds keepalive{30};
  };
  explicit EdgeNode(Parts parts);
  /// Orderly, as far as the broker answers.
  ~EdgeNode();
  EdgeNode(const EdgeNode&) = delete;
  EdgeNode& operator=(const EdgeNode&) = delete;

  /// Ends as a lost line: the broker publishes the will to the host.
  void close_with_will();
  /// `acknowledged`: number of births and data messages sent.
  LineStatus status() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon::plant::sparkplug
