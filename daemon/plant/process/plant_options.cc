#include "daemon/plant/process/plant_options.h"

#include <CLI/CLI.hpp>

#include "calib/files/calibration_json.h"

namespace cellcal::daemon::plant {

void describe_cellcal_plant(CLI::App& app, PlantOptions& options) {
  app.name("cellcal-plant");
  app.description(
      "The cell's line to its plant: from cellcald's outbox to an MQTT broker, as configured for cellcald ([plant]).");
  app.footer("Example: cellcal-plant --socket /run/cellcal/plant/cellcald.sock");
  app.add_option("--socket", options.socket,
                 "Socket of cellcald: folder plant next to its own, same name")
      ->capture_default_str();
  app.add_option("--longest-wait", options.longest_wait_s,
                 "Longest delay before a line or process is restarted [s]")
      ->check(CLI::Range(1.0, 3600.0))
      ->capture_default_str();
  app.set_version_flag("--version", calib::software_version());
}

}  // namespace cellcal::daemon::plant
