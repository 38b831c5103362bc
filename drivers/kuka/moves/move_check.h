#pragma once
// Validation of a move before any motion.

#include <cstddef>
#include <optional>
#include <span>

#include "drivers/kuka/moves/cause.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

/// Number of axes, finite values, axis limits, for each way-point and the target. A straight
/// joint-space line between two points within the limits stays within them, and so does a corner
/// within its triangle, so these points are sufficient.
std::optional<Cause> object_to(const Move& move, std::span<const AxisLimit> limits);

/// Additionally the limits of an axis correction, one per axis [deg]. `base_rad`: pose at
/// correction 0.
std::optional<Cause> object_to(const Move& move, std::span<const AxisLimit> limits,
                               std::span<const double> correction_limit_deg,
                               const AxisAngles& base_rad);

/// Legs of a move: way-points, and the target last.
inline std::size_t leg_count(const Move& move) { return move.via.size() + 1; }
inline const AxisAngles& leg_target(const Move& move, std::size_t leg) {
  return leg < move.via.size() ? move.via[leg].at_rad : move.target_rad;
}
/// The cause, attributed to the end of that leg.
Cause of_leg(Cause cause, const Move& move, std::size_t leg);

}  // namespace cellcal::drivers
