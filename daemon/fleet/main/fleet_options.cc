#include "daemon/fleet/main/fleet_options.h"

#include <CLI/CLI.hpp>

#include "calib/files/calibration_json.h"

namespace cellcal::daemon::fleet {

void describe_cellcal_fleet(CLI::App& app, FleetOptions& options) {
  app.name("cellcal-fleet");
  app.description(
      "The plant's collector: takes what cells publish from an MQTT broker into PostgreSQL, and answers questions.");
  app.footer("Example: cellcal-fleet --config /etc/cellcal/fleet.toml --check");
  app.add_option("--config", options.config_file, "Configuration, format cellcal.fleet/1")
      ->capture_default_str();
  app.add_flag("--check", options.check, "Check the configuration and exit");
  app.add_flag(
      "--reread-quarantine", options.reread,
      "After an update: read again what was refused, store what is now understood, and exit");
  app.add_flag("--verbose", options.verbose, "Log more");
  app.set_version_flag("--version", calib::software_version());
}

}  // namespace cellcal::daemon::fleet
