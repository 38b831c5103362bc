#pragma once
// Result of a move on a KUKA, as a plain value created on the cycle.

#include <cstdint>
#include <optional>

#include "drivers/kuka/moves/cause.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

struct CoreResult {
  std::uint32_t id = 0;
  MoveOutcome outcome = MoveOutcome::kRefused;
  Cause cause;
  std::uint32_t ipoc = 0;                           ///< of the last packet
  Interruption interruption = Interruption::kNone;  ///< of the link, if it is the cause
  bool in_space = false;                            ///< corrections in space
  AxisAngles at_rad;
  std::optional<Latch> latch;
};

}  // namespace cellcal::drivers
