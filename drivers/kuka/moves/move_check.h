#pragma once
// What can be said against a move before anything moves.

#include <optional>
#include <span>

#include "drivers/kuka/moves/cause.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

/// Number of axes, finite values, axis limits. A straight joint-space line between two points
/// within the limits stays within them, so the target alone decides.
std::optional<Cause> object_to(const Move& move, std::span<const AxisLimit> limits);

/// Those, and the limits of an axis correction, one per axis [deg]. `base_rad`: pose at correction
/// 0.
std::optional<Cause> object_to(const Move& move, std::span<const AxisLimit> limits,
                               std::span<const double> correction_limit_deg,
                               const AxisAngles& base_rad);

}  // namespace cellcal::drivers
