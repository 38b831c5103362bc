#pragma once
// Messages between the daemon and the plant process, as JSON. Both validate the other's messages like foreign
// input: all functions throw calib::FileError.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/config/network_config.h"
#include "daemon/plant/line/edge_node.h"
#include "daemon/plant/line/line_status.h"
#include "daemon/plant/messages/outbox.h"

namespace cellcal::daemon::plant {

/// From the daemon, every second: the configured line, and the state of the cell.
struct Orders {
  std::string daemon{};  ///< id of the answering daemon: another one may have another journal
  std::optional<PlantConfig> plant{};  ///< the part that a line needs; none: no plant configured
  bool mock = false;                   ///< emulated cell
  std::vector<sparkplug::Metric> metrics{};  ///< empty: disabled
};

/// Maximum size of a request, and of the rows that it acknowledges.
inline constexpr std::size_t kMostDeskBody = std::size_t{1} << 19, kMostDeskRows = 1000;

std::string to_json(const Orders& orders);
Orders orders_from_json(std::string_view json);

std::string to_json(const LinesStatus& lines);
LinesStatus lines_from_json(std::string_view json);

std::string to_json(const WaitingCount& count);
WaitingCount count_from_json(std::string_view json);

/// Two lines each: description, and the unmodified message.
std::string to_lines(const std::vector<WaitingFact>& facts);
std::vector<WaitingFact> facts_from_lines(std::string_view lines);

std::string rows_to_json(const std::vector<std::int64_t>& rows);
std::vector<std::int64_t> rows_from_json(std::string_view json);

}  // namespace cellcal::daemon::plant
