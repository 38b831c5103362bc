#pragma once
// What the cell's daemon and the process that has its line say to each other, as JSON. Each reads what the other writes as strictly
// as what comes from anybody: all throw calib::FileError.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/config/plant_config.h"
#include "daemon/plant/line/line_status.h"
#include "daemon/plant/line/payload.h"
#include "daemon/plant/messages/outbox.h"

namespace cellcal::daemon::plant {

/// From the daemon, once a second: which line there is to be, and how the cell stands.
struct Orders {
  std::string daemon{};  ///< which one answers: another one has perhaps another journal
  std::optional<PlantConfig> plant{};        ///< as far as a line needs it; none: no plant is named
  bool mock = false;                         ///< the cell is emulated
  std::vector<sparkplug::Metric> metrics{};  ///< empty: not asked for
};

/// What a request may hold at most, and rows that are acknowledged by one.
inline constexpr std::size_t kMostDeskBody = std::size_t{1} << 19, kMostDeskRows = 1000;

std::string to_json(const Orders& orders);
Orders orders_from_json(std::string_view json);

std::string to_json(const LinesStatus& lines);
LinesStatus lines_from_json(std::string_view json);

std::string to_json(const WaitingCount& count);
WaitingCount count_from_json(std::string_view json);

/// Two lines each: what it is, and the message as it is.
std::string to_lines(const std::vector<WaitingFact>& facts);
std::vector<WaitingFact> facts_from_lines(std::string_view lines);

std::string rows_to_json(const std::vector<std::int64_t>& rows);
std::vector<std::int64_t> rows_from_json(std::string_view json);

}  // namespace cellcal::daemon::plant
