#pragma once
// Raw events and readings of old sessions, dropped.

#include <optional>

#include "daemon/cli/client.h"

namespace cellcal::daemon {

int retain(const Connection& daemon, bool dry_run, std::optional<int> days,
           std::optional<double> megabytes);

}  // namespace cellcal::daemon
