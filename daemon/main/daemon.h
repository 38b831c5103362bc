#pragma once

#include <functional>

#include "daemon/config/config.h"

namespace cellcal::daemon {

/// Checks certificate and key of the network's listener, without which no start succeeds. Throws SocketError.
void check_tls_of(const DaemonConfig& config);

/// Checks all files named by the configuration. Throws drivers::ConfigError, SocketError, std::runtime_error.
void check_files_of(const DaemonConfig& config);

/// Runs until SIGTERM or SIGINT. Throws where it cannot start: drivers::ConfigError, JournalError, SocketError.
/// `read_config` reloads the file on SIGHUP, from another thread.
void run_daemon(const DaemonConfig& config, const std::function<DaemonConfig()>& read_config);

}  // namespace cellcal::daemon
