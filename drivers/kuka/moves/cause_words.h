#pragma once
// Sentences of causes, generated here only and off the cycle, since they allocate.

#include <string>

#include "drivers/kuka/moves/core_result.h"

namespace cellcal::drivers {

/// Event, location, and remedy; empty if there is nothing to report.
std::string words(const CoreResult& result);
MoveResult to_move_result(const CoreResult& result);

}  // namespace cellcal::drivers
