#pragma once
// Command lines of the programs that run as services: cellcald, cellcal-plant, cellcal-fleet.

#include <string>

namespace CLI {
class App;
}

namespace cellcal::daemon {

struct DaemonOptions {
  std::string config_file = "/etc/cellcal/cellcald.toml";
  bool check = false, verbose = false;
};
void describe_cellcald(CLI::App& app, DaemonOptions& options);

struct PlantOptions {
  std::string socket = "/run/cellcal/plant/cellcald.sock";
  double longest_wait_s = 60.0;
};
void describe_cellcal_plant(CLI::App& app, PlantOptions& options);

struct FleetOptions {
  std::string config_file = "/etc/cellcal/fleet.toml";
  bool check = false, reread = false, verbose = false;
};
void describe_cellcal_fleet(CLI::App& app, FleetOptions& options);

/// As root, takes user and groups of the installed services for the rest of the process; without such a user nothing.
/// Throws std::system_error.
void become_user_of_service();

}  // namespace cellcal::daemon
