#include "daemon/service/time_left.h"

#include <algorithm>
#include <chrono>

namespace cellcal::daemon {

std::optional<double> TimeLeft::look(Phase phase, std::size_t done, std::size_t total,
                                     drivers::TimePoint now) {
  if (!first_move_ && phase == Phase::kTransit) {
    first_move_ = now;
    done_at_first_move_ = last_done_ = done;
  }
  if (first_move_ && done > last_done_) {
    last_done_ = done;
    last_touch_ = now;
  }
  const std::size_t made = last_done_ - done_at_first_move_;
  const Phases touching = kMovingPhases | kStandingPhases;
  if (!first_move_ || made == 0 || !touching.has(phase)) return std::nullopt;
  using Seconds = std::chrono::duration<double>;
  const double each_s = Seconds(last_touch_ - *first_move_).count() / static_cast<double>(made);
  const double since_s = Seconds(now - last_touch_).count();
  return std::max(0.0, each_s * (static_cast<double>(total) - static_cast<double>(done)) - since_s);
}

}  // namespace cellcal::daemon
