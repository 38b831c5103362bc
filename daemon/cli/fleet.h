#pragma once
// What the plant's collector (cellcal-fleet) knows of its cells.

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "daemon/cli/client.h"

namespace cellcal::daemon {

int fleet_status(const Connection& fleet);
/// kNotPublishable where something is overdue.
int fleet_overdue(const Connection& fleet);
int fleet_compare(const Connection& fleet, const std::string& robot, const std::string& joint);

enum class Exported { kCalibration, kCheck, kCertificate };
struct FleetExport {
  std::string cell;                     ///< PLANT/CELL
  std::optional<std::int64_t> session;  ///< none: the newest
  std::string journal;                  ///< empty: the newest that has it
  Exported what = Exported::kCalibration;
  std::filesystem::path output;  ///< a file; of a certificate a directory; empty: standard output
};
int fleet_export(const Connection& fleet, const FleetExport& command);

// Why a cell needs attention, in words.

/// Of one entry of `needs` (daemon/fleet/api): what it is, since when, what to do. One line.
std::string need_words(const nlohmann::json& need);

}  // namespace cellcal::daemon
