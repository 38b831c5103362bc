// cellcald: the daemon. Exit status 0 terminated by a signal, 1 start failed, 2 wrong usage or configuration,
// where a restart does not help.

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "calib/estimate/solve.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/log.h"
#include "daemon/files/service_options.h"
#include "daemon/journal/journal.h"
#include "daemon/main/daemon.h"
#include "drivers/error.h"

int main(int argc, char** argv) {
  using cellcal::daemon::DaemonConfig;
  constexpr int kFailed = 1, kUsage = 2;
  cellcal::daemon::DaemonOptions options;
  CLI::App app;
  cellcal::daemon::describe_cellcald(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kUsage;
  }
  const auto complain = [](const std::exception& error) {
    std::fprintf(stderr, "cellcald: %s\n",
                 cellcal::daemon::printable(cellcal::daemon::system_words(error)).c_str());
  };
  const auto read_config = [&options] {
    DaemonConfig config = cellcal::daemon::load_config(options.config_file);
    config.log_debug |= options.verbose;
    return config;
  };
  DaemonConfig config;
  try {
    // The service may not read all that root may.
    if (options.check && options.config_file == cellcal::daemon::DaemonOptions().config_file)
      cellcal::daemon::become_user_of_service();
    config = read_config();
    if (options.check)
      cellcal::daemon::check_files_of(config);
    else
      cellcal::daemon::check_tls_of(config);
  } catch (const std::exception& error) {
    complain(error);
    return kUsage;
  }
  if (options.check) {
    std::printf("%s: valid\n", options.config_file.c_str());
    return 0;
  }
  cellcal::calib::quiet_solver();
  try {
    cellcal::daemon::set_up_log(config.log_debug);
    cellcal::daemon::run_daemon(config, read_config);
    return 0;
  } catch (const cellcal::drivers::ConfigError& error) {
    complain(error);
    return kUsage;
  } catch (const cellcal::daemon::OtherJournalError& error) {
    complain(error);
    return kUsage;
  } catch (const std::exception& error) {
    complain(error);
    return kFailed;
  }
}
