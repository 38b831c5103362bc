#pragma once
// Sparkplug B's payloads as bytes. Protobuf stays behind it.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/plant/sparkplug/metric.h"

namespace cellcal::daemon::plant::sparkplug {

/// Metrics of a birth have their types, those of data do not: a host knows them.
enum class Types { kDeclared, kKnown };
/// `time_ms`: since 1970, UTC. `seq`: none in an NDEATH.
std::string payload(const std::vector<Metric>& metrics, std::uint64_t time_ms,
                    std::optional<std::uint8_t> seq, Types types);

inline constexpr const char* kRebirth = "Node Control/Rebirth";
/// Whether a command asks for a new birth. Anybody may have sent it: what is no payload asks for nothing.
bool asks_for_rebirth(std::string_view command);

}  // namespace cellcal::daemon::plant::sparkplug
