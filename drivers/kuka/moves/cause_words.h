#pragma once
// The words of a cause, made here and nowhere else, off the cycle: making them allocates.

#include <string>

#include "drivers/kuka/moves/core_result.h"

namespace cellcal::drivers {

/// What happened, where, and what to do next; empty where nothing is to be said.
std::string words(const CoreResult& result);
MoveResult to_move_result(const CoreResult& result);

}  // namespace cellcal::drivers
