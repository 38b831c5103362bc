#pragma once
// Following-error monitor. It answers two questions, the second the quicker one:
//
// 1. Following error: is an axis farther than follow_tolerance_deg from everything that was
//    commanded within follow_window_s?
// 2. Standstill: does an axis stand although its command goes on? Let `lag` be at most
//    longest_lag_s. Within any window an arm that follows moves at least as far as the least that
//    its command moved within a window as long, now or up to `lag` ago. An axis that does less than
//    a quarter of it stands: at a limit that clamps in silence, at a closed brake, at a wall.

#include <optional>

#include "drivers/kuka/moves/cause.h"
#include "drivers/kuka/moves/position_record.h"
#include "drivers/kuka/rsi/rsi_config.h"

namespace cellcal::drivers {

/// AxisNotFollowing or AxisStands. After each packet of a moving arm; `cycle_s` from packet to packet.
std::optional<Cause> following_fault(const PositionRecord& record, const RsiConfig& config,
                                     double cycle_s);

}  // namespace cellcal::drivers
