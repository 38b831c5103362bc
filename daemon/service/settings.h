#pragma once
// What a session takes from the configuration when it begins.

#include <functional>
#include <memory>

#include "daemon/runner/backend.h"
#include "daemon/session/state.h"

namespace cellcal::daemon {

struct SessionSettings {
  TouchPolicy touch;
  Timeouts timeouts;
  int retries = 0;               ///< harmless interruptions after which a session goes on by itself
  SearchLimits search_limits{};  ///< of today's link: a resumed session has its own touch policy
  BusyRepeats repeats{};         ///< where this computer was late; of today's configuration as well
  double speed_fraction = 1.0;   ///< of the robot file's axis speeds, in transits
  double hand_speed_m_s = 0.0;   ///< HandSpeed::Bound; 0: none
};

/// `most_speed`: share of the robot file's axis speeds that no move exceeds, whatever the configuration allows.
using MakeBackend = std::function<std::unique_ptr<Backend>(const calib::Cell&, double most_speed)>;

}  // namespace cellcal::daemon
