#pragma once
// What a taught point says, or why it cannot be understood.

#include <optional>

#include "daemon/krl/krl_data.h"
#include "daemon/krl/status_turn.h"

namespace cellcal::daemon::krl {

/// Of S and T: those of the arm's six axes.
inline constexpr int kStatusBits = 7, kTurnBits = 63;

/// Components of its kind alone, each a number; the six that it needs, S and T both or none, external
/// axes at 0.
std::optional<Why> wrong_value(const Point& point);

/// S and T, where they are stated.
std::optional<StatusTurn> status_turn(const Point& point);

}  // namespace cellcal::daemon::krl
