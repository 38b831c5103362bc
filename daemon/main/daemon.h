#pragma once

#include <functional>

#include "daemon/config/config.h"

namespace cellcal::daemon {

/// Checks the files named by the configuration that a start requires. Throws SocketError.
void check_files_of(const DaemonConfig& config);

/// Runs until SIGTERM or SIGINT. Throws where it cannot start: JournalError, SocketError,
/// std::filesystem::filesystem_error. `read_config` reloads the file on SIGHUP, from another thread.
void run_daemon(const DaemonConfig& config, const std::function<DaemonConfig()>& read_config);

}  // namespace cellcal::daemon
