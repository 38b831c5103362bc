#pragma once
// What cellcal-fleet's command line holds.

#include <filesystem>
#include <string>
#include <string_view>

#include "daemon/fleet/collector.h"
#include "daemon/fleet/fleet_server.h"

namespace CLI {
class App;
}

namespace cellcal::daemon::fleet {

struct FleetOptions {
  std::string config_file = "/etc/cellcal/fleet.toml";
  bool check = false, reread = false, verbose = false;
};

void describe_cellcal_fleet(CLI::App& app, FleetOptions& options);

// fleet.toml, "cellcal.fleet/1".

struct FleetConfig {
  CollectorConfig collector;
  Listen listen;
};

/// Throw calib::FileError.
FleetConfig parse_fleet_config(std::string_view text, const std::string& name);
FleetConfig load_fleet_config(const std::filesystem::path& path);

}  // namespace cellcal::daemon::fleet
