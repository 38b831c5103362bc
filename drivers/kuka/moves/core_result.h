#pragma once
// How a move on a KUKA ended, as a plain value that the cycle passes on.

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
  Interruption interruption = Interruption::kNone;  ///< of the link, where it is why
  bool in_space = false;                            ///< by corrections in space
  AxisAngles at_rad;
  std::optional<Latch> latch;
};

}  // namespace cellcal::drivers
