#pragma once
// A thread that answers over HTTP.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/api/http/message.h"
#include "daemon/fleet/collect/collector.h"
#include "daemon/fleet/store/reading.h"

namespace cellcal::daemon::fleet {

struct Listen {
  std::filesystem::path socket;
  std::string address;     ///< empty: only the socket
  std::uint16_t port = 0;  ///< 0: any that is free
  /// Names, in lower case, under which a proxy or a browser finds this computer, beside its addresses.
  std::vector<std::string> host_names{};
};

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

// Questions over HTTP, and what the database says.

/// Throws nothing but std::bad_alloc.
Response answer(const Request& request, Reading& reading, const Counters& counters);

/// Prometheus' text. The plant's own numbers are left out while the database is away.
std::string fleet_metrics(Reading& reading, const Counters& counters);

}  // namespace cellcal::daemon::fleet
