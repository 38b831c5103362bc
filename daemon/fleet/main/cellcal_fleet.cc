// cellcal-fleet: the plant's collector. Exit status 0 ended by a signal, 1 could not go on, 2 wrong usage or
// configuration: what does not get better by trying again.

#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "daemon/files/printable.h"
#include "daemon/fleet/main/fleet_config.h"
#include "daemon/fleet/main/fleet_options.h"
#include "daemon/main/log.h"

namespace {

std::atomic<bool> stop{false};

void run(const cellcal::daemon::fleet::FleetConfig& config) {
  ::setenv("PGCONNECT_TIMEOUT", "10", 0);  // a database host that does not answer is away
  std::signal(SIGTERM, [](int) { stop = true; });
  std::signal(SIGINT, [](int) { stop = true; });
  std::signal(SIGPIPE, SIG_IGN);
  cellcal::daemon::fleet::Collector collector(config.collector);
  const cellcal::daemon::fleet::FleetServer server(config.listen, config.collector.store.connection,
                                                   collector.counters());
  spdlog::info("collecting as \"{}\"; answers on {}", config.collector.broker.client,
               config.listen.socket.string());
  sd_notify(0, "READY=1");
  collector.run(stop, [] { sd_notify(0, "WATCHDOG=1"); });
  sd_notify(0, "STOPPING=1");
}

}  // namespace

int main(int argc, char** argv) {
  using namespace cellcal::daemon;
  constexpr int kFailed = 1, kUsage = 2;
  fleet::FleetOptions options;
  CLI::App app;
  fleet::describe_cellcal_fleet(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kUsage;
  }
  const auto complain = [](const std::exception& error) {
    std::fprintf(stderr, "cellcal-fleet: %s\n", printable(error.what()).c_str());
  };
  fleet::FleetConfig config;
  try {
    config = fleet::load_fleet_config(options.config_file);
  } catch (const std::exception& error) {
    complain(error);
    return kUsage;
  }
  if (options.check) {
    std::printf("%s: valid\n", options.config_file.c_str());
    return 0;
  }
  try {
    set_up_log(options.verbose);
    run(config);
    return 0;
  } catch (const std::exception& error) {
    complain(error);
    return kFailed;
  }
}
