#pragma once
// Backends available to the daemon.

#include <memory>

#include "calib/model/robot.h"
#include "daemon/config/config.h"
#include "daemon/runner/backend.h"

namespace cellcal::daemon {

/// KUKA controller over RSI and contact sensor on a serial port. Opens nothing yet. Throws
/// drivers::ConfigError.
std::unique_ptr<Backend> make_rsi_backend(const DaemonConfig& config, const calib::Cell& cell);

/// KUKA controller over EKI and contact sensor on a serial port; likewise.
std::unique_ptr<Backend> make_eki_backend(const DaemonConfig& config, const calib::Cell& cell);

/// Emulated cell in this process, on virtual time, over the configured wire.
std::unique_ptr<Backend> make_mock_backend(const DaemonConfig& config, const calib::Cell& cell,
                                           const std::string& load = {});

}  // namespace cellcal::daemon
