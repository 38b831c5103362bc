#pragma once
// Published calibrations as versions. Each function returns its exit status and throws on failure.

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/cli/client.h"

namespace cellcal::daemon {

/// For the cell of that session; without one, of the calibration in use.
int list_versions(const Connection& daemon, std::optional<std::int64_t> of_cell);
/// Without a session: the calibration published before the one in use.
int activate_version(const Connection& daemon, std::optional<std::int64_t> session,
                     const std::string& reason);
int compare_versions(const Connection& daemon, std::int64_t before, std::int64_t after);

// Deletion of raw events and readings of old sessions.

int retain(const Connection& daemon, bool dry_run, std::optional<int> days,
           std::optional<double> megabytes);

}  // namespace cellcal::daemon
