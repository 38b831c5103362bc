#pragma once
// Published calibrations as versions. Each returns its exit status and throws when it failed.

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/cli/client.h"

namespace cellcal::daemon {

/// Of the cell of that session; of the calibration in use where there is none.
int list_versions(const Connection& daemon, std::optional<std::int64_t> of_cell);
/// No session: the published one before the one in use.
int activate_version(const Connection& daemon, std::optional<std::int64_t> session,
                     const std::string& reason);
int compare_versions(const Connection& daemon, std::int64_t before, std::int64_t after);

// Raw events and readings of old sessions, dropped.

int retain(const Connection& daemon, bool dry_run, std::optional<int> days,
           std::optional<double> megabytes);

}  // namespace cellcal::daemon
