#pragma once
// The backends that a daemon can be put together with.

#include <memory>

#include "calib/model/robot.h"
#include "daemon/config/config.h"
#include "daemon/runner/backend.h"

namespace cellcal::daemon {

/// A KUKA controller over RSI and a contact sensor on a serial port. Opens nothing yet. Throws
/// drivers::ConfigError.
std::unique_ptr<Backend> make_rsi_backend(const DaemonConfig& config, const calib::Cell& cell);

/// A KUKA controller over EKI and a contact sensor on a serial port, likewise.
std::unique_ptr<Backend> make_eki_backend(const DaemonConfig& config, const calib::Cell& cell);

/// An emulated cell in this process, on virtual time, over the wire that the configuration names.
std::unique_ptr<Backend> make_mock_backend(const DaemonConfig& config, const calib::Cell& cell);

}  // namespace cellcal::daemon
