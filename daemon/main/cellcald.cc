// cellcald: the daemon. Exit status 0 ended by a signal, 1 could not start, 2 wrong usage or
// configuration: what does not get better by trying again.

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "calib/files/calibration_json.h"
#include "daemon/files/printable.h"
#include "daemon/main/daemon.h"
#include "daemon/main/log.h"

int main(int argc, char** argv) {
  using cellcal::daemon::DaemonConfig;
  constexpr int kFailed = 1, kUsage = 2;
  std::string config_file = "/etc/cellcal/cellcald.toml";
  bool check = false, verbose = false;
  CLI::App app("The calibration daemon: runs sessions, keeps their journal, answers on a socket.");
  app.footer("Example: cellcald --config /etc/cellcal/cellcald.toml --check");
  app.add_option("--config", config_file, "Configuration, format cellcal.daemon/1")
      ->capture_default_str();
  app.add_flag("--check", check, "Check the configuration and exit");
  app.add_flag("--verbose", verbose, "Log every step of a session");
  app.set_version_flag("--version", cellcal::calib::software_version());
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kUsage;
  }
  const auto complain = [](const std::exception& error) {
    std::fprintf(stderr, "cellcald: %s\n", cellcal::daemon::printable(error.what()).c_str());
  };
  DaemonConfig config;
  try {
    config = cellcal::daemon::load_config(config_file);
  } catch (const std::exception& error) {
    complain(error);
    return kUsage;
  }
  if (check) {
    std::printf("%s: valid\n", config_file.c_str());
    return 0;
  }
  try {
    cellcal::daemon::set_up_log(verbose);
    cellcal::daemon::run_daemon(config);
    return 0;
  } catch (const std::exception& error) {
    complain(error);
    return kFailed;
  }
}
