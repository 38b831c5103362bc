#pragma once
// Does the arm follow what it is commanded? Two questions, the second the quicker one:
//
// - Is an axis farther from everything that was commanded within follow_window_s than the
// tolerance?
// - Does an axis stand although its command goes on? An arm whose answer to a command is spread
// over
//   at most longest_lag_s moves, within any window, at least as far as the least that its command
//   moved within a window as long, now or up to that lag ago. An axis that does a quarter of it
//   stands: at a limit that clamps in silence, at a closed brake, at a wall.

#include <optional>

#include "drivers/kuka/cause.h"
#include "drivers/kuka/position_record.h"
#include "drivers/kuka/rsi_config.h"

namespace cellcal::drivers {

struct FollowFault {
  Cause cause = Cause::kNone;
  std::uint8_t axis = 0;
  double a = 0.0, b = 0.0;  ///< as CoreResult has them
};

/// After each packet of a moving arm; `cycle_s` from packet to packet.
std::optional<FollowFault> follow_fault(const PositionRecord& record, const RsiConfig& config,
                                        double cycle_s);

}  // namespace cellcal::drivers
