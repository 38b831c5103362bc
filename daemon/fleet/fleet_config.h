#pragma once
// fleet.toml, "cellcal.fleet/1".

#include <filesystem>
#include <string_view>

#include "daemon/fleet/collector.h"
#include "daemon/fleet/fleet_server.h"

namespace cellcal::daemon::fleet {

struct FleetConfig {
  CollectorConfig collector;
  Listen listen;
};

/// Throw calib::FileError.
FleetConfig parse_fleet_config(std::string_view text, const std::string& name);
FleetConfig load_fleet_config(const std::filesystem::path& path);

}  // namespace cellcal::daemon::fleet
