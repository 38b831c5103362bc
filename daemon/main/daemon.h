#pragma once

#include <functional>

#include "daemon/config/config.h"

namespace cellcal::daemon {

/// Reads the files that the configuration names and that a start needs. Throws SocketError.
void check_files_of(const DaemonConfig& config);

/// Runs until SIGTERM or SIGINT. Throws what keeps it from starting: JournalError, SocketError,
/// std::filesystem::filesystem_error.
/// `read_config` reads the file again when SIGHUP asks for it, from another thread.
void run_daemon(const DaemonConfig& config, const std::function<DaemonConfig()>& read_config);

}  // namespace cellcal::daemon
