#pragma once
// Settings that a session takes from the configuration when it begins.

#include <functional>
#include <memory>

#include "daemon/runner/backend.h"
#include "daemon/session/state.h"

namespace cellcal::daemon {

struct SessionSettings {
  TouchPolicy touch;
  Timeouts timeouts;
  int retries = 0;  ///< automatic continuations after harmless interruptions
  /// Limits of the current link: a resumed session keeps its own touch policy.
  SearchLimits search_limits{};
  BusyRepeats repeats{};        ///< after lateness of this computer; also of today's configuration
  double speed_fraction = 1.0;  ///< share of the robot file's axis speeds in transits
  double hand_speed_m_s = 0.0;  ///< HandSpeed::Bound; 0: none
};

/// `most_speed`: upper bound of the share of the robot file's axis speeds, whatever the configuration allows.
using MakeBackend = std::function<std::unique_ptr<Backend>(const calib::Cell&, double most_speed)>;

}  // namespace cellcal::daemon
