// cellcal-fleet: the plant's collector. Exit status 0: ended by a signal; 1: failed; 2: wrong usage
// or configuration, for which a restart does not help.

#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>

#include "daemon/config/config_values.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/log.h"
#include "daemon/files/service_options.h"
#include "daemon/files/supervisor.h"
#include "daemon/fleet/collector.h"
#include "daemon/fleet/fleet_server.h"

namespace {

/// Data limit: batches of 16 MB and their copies in the database client. Excludes MQTT's largest
/// packet (256 MiB).
constexpr std::size_t kMostBytes = std::size_t{240} << 20;

std::atomic<bool> stop{false};

void run(const cellcal::daemon::fleet::FleetConfig& config) {
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

/// May run while a collector is running.
void reread(const cellcal::daemon::fleet::FleetConfig& config) {
  using namespace cellcal::daemon;
  constexpr std::size_t kMostNamed = 20;
  fleet::Store store(config.collector.store);
  const fleet::Reread result = fleet::reread_quarantine(store);
  std::printf("%zu stored, %zu were there already, %zu refused again\n", result.stored,
              result.twice, result.refused);
  if (result.cut.empty()) return;
  std::printf("%zu were kept in part only and cannot be read again:\n", result.cut.size());
  for (std::size_t i = 0; i < std::min(kMostNamed, result.cut.size()); ++i)
    std::printf("  %s\n", printable(result.cut[i]).c_str());
  if (result.cut.size() > kMostNamed)
    std::printf("  and %zu more, in fleet.quarantine\n", result.cut.size() - kMostNamed);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace cellcal::daemon;
  constexpr int kFailed = 1, kUsage = 2;
  FleetOptions options;
  CLI::App app;
  describe_cellcal_fleet(app, options);
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
    if (options.check && options.config_file == FleetOptions().config_file)
      become_user_of_service();
    config = fleet::load_fleet_config(options.config_file);
    if (options.check) {
      const auto& broker = config.collector.broker;
      for (const auto& file : {broker.ca, broker.certificate, broker.key, broker.password_file})
        refuse_unreadable(file);
      refuse_secret_of_all(broker.key);
      refuse_secret_of_all(broker.password_file);
    }
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
    if (options.reread) {
      reread(config);
      return 0;
    }
    return supervise({.most_bytes = kMostBytes}, [&config](std::uint64_t) {
      run(config);
      return 0;
    });
  } catch (const std::exception& error) {
    complain(error);
    return kFailed;
  }
}
