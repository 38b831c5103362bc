#include "daemon/main/options.h"

#include <CLI/CLI.hpp>

#include "calib/files/calibration_json.h"

namespace cellcal::daemon {

void describe_cellcald(CLI::App& app, DaemonOptions& options) {
  app.name("cellcald");
  app.description(
      "The calibration daemon: runs sessions, keeps their journal, answers on a socket.");
  app.footer("Example: cellcald --config /etc/cellcal/cellcald.toml --check");
  app.add_option("--config", options.config_file, "Configuration, format cellcal.daemon/1")
      ->capture_default_str();
  app.add_flag("--check", options.check,
               "Check the configuration, with TLS certificate and key, and exit");
  app.add_flag("--verbose", options.verbose, "Log every step of a session");
  app.set_version_flag("--version", calib::software_version());
}

}  // namespace cellcal::daemon
