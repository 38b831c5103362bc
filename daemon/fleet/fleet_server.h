#pragma once
// HTTP server of the collector, in a thread.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/api/http/http.h"
#include "daemon/fleet/collector.h"
#include "daemon/fleet/judge.h"

namespace cellcal::daemon::fleet {

struct Listen {
  std::filesystem::path socket;
  std::string address;     ///< empty: only the socket
  std::uint16_t port = 0;  ///< 0: any free port
  /// Host names, in lower case, that are accepted in addition to this computer's addresses.
  std::vector<std::string> host_names{};
};

// fleet.toml, "cellcal.fleet/1".

struct FleetConfig {
  CollectorConfig collector;
  Listen listen;
};

/// Throw calib::FileError.
FleetConfig parse_fleet_config(std::string_view text, const std::string& name);
FleetConfig load_fleet_config(const std::filesystem::path& path);

class FleetServer {
 public:
  /// Throws SocketError. `counters` must live longer.
  FleetServer(const Listen& listen, std::string database, const Counters& counters);
  ~FleetServer();
  FleetServer(const FleetServer&) = delete;
  FleetServer& operator=(const FleetServer&) = delete;

  std::uint16_t port() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Responses from the database.

/// Throws only std::bad_alloc.
Response answer(const Request& request, Reading& reading, const Counters& counters);

/// Metrics in Prometheus' text format; those of the plant are omitted without a database.
std::string fleet_metrics(Reading& reading, const Counters& counters);

}  // namespace cellcal::daemon::fleet
