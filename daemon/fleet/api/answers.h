#pragma once
// Questions over HTTP, and what the database says.

#include <string>

#include "daemon/api/http/message.h"
#include "daemon/fleet/collect/collector.h"
#include "daemon/fleet/store/reading.h"

namespace cellcal::daemon::fleet {

/// Throws nothing but std::bad_alloc.
Response answer(const Request& request, Reading& reading, const Counters& counters);

/// Prometheus' text. The plant's own numbers are left out while the database is away.
std::string fleet_metrics(Reading& reading, const Counters& counters);

}  // namespace cellcal::daemon::fleet
