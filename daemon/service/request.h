#pragma once
// Validation of a request before any file is read.

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

#include "daemon/runner/backend.h"
#include "daemon/session/state.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon {

/// A session is under way.
struct BusyError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The request cannot be carried out: wrong file, or nothing to resume.
struct RequestError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Throws RequestError.
void check(const RunRequest& request);

// Settings that a session takes from the configuration when it begins.

struct SessionSettings {
  TouchPolicy touch;
  Timeouts timeouts;
  int retries = 0;  ///< automatic continuations after harmless interruptions
  /// Limits of the current link: a resumed session keeps its own touch policy.
  SearchLimits search_limits{};
  BusyRepeats repeats{};        ///< after lateness of this computer; also of today's configuration
  double speed_fraction = 1.0;  ///< share of the robot file's axis speeds in transits
  double hand_speed_m_s = 0.0;  ///< HandSpeed::Bound; 0: none
  double positioner_speed_rad_s = 0.0;  ///< likewise; 0: the controller bounds it
};

/// `most_speed`: upper bound of the share of the robot file's axis speeds, whatever the configuration allows.
/// `load`: held by the emulated tools.
using MakeBackend = std::function<std::unique_ptr<Backend>(const calib::Cell&, double most_speed,
                                                           const std::string& load)>;

}  // namespace cellcal::daemon
