#pragma once
// What cellcal-fleet's command line holds.

#include <string>

namespace CLI {
class App;
}

namespace cellcal::daemon::fleet {

struct FleetOptions {
  std::string config_file = "/etc/cellcal/fleet.toml";
  bool check = false, reread = false, verbose = false;
};

void describe_cellcal_fleet(CLI::App& app, FleetOptions& options);

}  // namespace cellcal::daemon::fleet
