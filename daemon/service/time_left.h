#pragma once
// Remaining time of a session, estimated from the pace of its touches so far.

#include <cstddef>
#include <optional>

#include "daemon/session/phase.h"
#include "drivers/time.h"

namespace cellcal::daemon {

class TimeLeft {
 public:
  /// Seconds; none before the first touch. To be called after every step. `done` and `total` count touches.
  std::optional<double> look(Phase phase, std::size_t done, std::size_t total,
                             drivers::TimePoint now);

 private:
  std::size_t done_at_first_move_ = 0, last_done_ = 0;
  std::optional<drivers::TimePoint> first_move_;
  drivers::TimePoint last_touch_{};
};

}  // namespace cellcal::daemon
