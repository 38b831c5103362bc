#pragma once
// Value of a taught point, or the reason why it is not understood.

#include <optional>
#include <set>

#include "daemon/krl/krl_data.h"
#include "daemon/krl/status_turn.h"

namespace cellcal::daemon::krl {

/// Bits of S and T for the arm's six axes.
inline constexpr int kStatusBits = 7, kTurnBits = 63;
/// Of S: the point was taught with the absolutely accurate model.
inline constexpr int kAccurateBit = 16;

/// Requirements: components of its kind only, all numeric; the six required ones, S and T both or
/// none; an external axis that may carry the arm at 0, save those of `understood`.
std::optional<Why> wrong_value(const Point& point, const calib::ExternalAxes& external,
                               const std::set<int>& understood);

/// S and T, if stated.
std::optional<StatusTurn> status_turn(const Point& point);
/// kAccurateBit is set.
bool taught_accurately(const Point& point);

}  // namespace cellcal::daemon::krl
