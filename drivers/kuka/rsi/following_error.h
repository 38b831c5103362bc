#pragma once
// Following-error monitor with two criteria, the second of which reacts faster:
//
//   1. Following error: an axis is farther than follow_tolerance_deg from everything that was
//      commanded within follow_window_s.
//   2. Standstill: an axis does not move although its command advances. Let `lag` be at most
//      longest_lag_s. Within any window an arm that follows moves at least as far as the smallest
//      travel commanded within a window of equal length, now or up to `lag` ago. An axis that moves
//      less than a quarter of it is at standstill: at a limit that clamps without a message, at a
//      closed brake, at an obstacle.

#include <optional>

#include "drivers/kuka/moves/cause.h"
#include "drivers/kuka/moves/position_record.h"
#include "drivers/kuka/rsi/rsi_config.h"

namespace cellcal::drivers {

/// AxisNotFollowing or AxisStands. To be called after each packet of a moving arm; `cycle_s` from
/// packet to packet.
std::optional<Cause> following_fault(const PositionRecord& record, const RsiConfig& config,
                                     double cycle_s);

}  // namespace cellcal::drivers
