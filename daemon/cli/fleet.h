#pragma once
// Data of the plant's collector (cellcal-fleet) on its cells.

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "daemon/cli/client.h"

namespace cellcal::daemon {

int fleet_status(const Connection& fleet);
/// kNotPublishable where a calibration or check is overdue.
int fleet_overdue(const Connection& fleet);
int fleet_compare(const Connection& fleet, const std::string& robot, const std::string& joint);

enum class Exported { kCalibration, kCheck, kCertificate };
struct FleetExport {
  std::string cell;                     ///< PLANT/CELL
  std::optional<std::int64_t> session;  ///< none: the newest
  std::string journal;                  ///< empty: the newest that contains it
  Exported what = Exported::kCalibration;
  /// A file, or a directory for a certificate; empty: standard output.
  std::filesystem::path output;
};
int fleet_export(const Connection& fleet, const FleetExport& command);

// Reason why a cell needs attention.

/// From one entry of `needs` (daemon/fleet/judge), one line: the need, its begin, the action.
std::string need_words(const nlohmann::json& need);

}  // namespace cellcal::daemon
