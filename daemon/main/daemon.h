#pragma once

#include "daemon/config/config.h"

namespace cellcal::daemon {

/// Runs until SIGTERM or SIGINT. Throws what keeps it from starting: JournalError, SocketError,
/// std::filesystem::filesystem_error.
void run_daemon(const DaemonConfig& config);

}  // namespace cellcal::daemon
