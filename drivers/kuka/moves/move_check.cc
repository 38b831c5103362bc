#include "drivers/kuka/moves/move_check.h"

#include <cmath>

#include "drivers/units.h"

namespace cellcal::drivers {
std::optional<Cause> object_to(const Move& move, std::span<const AxisLimit> limits) {
  const std::size_t axes = limits.size();
  if (move.target_rad.size() != axes) {
    return cause::AxisCount{move.target_rad.size(), axes};
  }
  if (!std::isfinite(move.cruise_s) || move.cruise_s < 0.0) {
    return cause::BadCruise{move.cruise_s};
  }
  for (std::size_t i = 0; i < axes; ++i) {
    const auto axis = static_cast<std::uint8_t>(i);
    const double target = move.target_rad[i];
    const AxisLimit& limit = limits[i];
    if (!std::isfinite(target)) return cause::NotFinite{axis, target};
    if (target < limit.min_rad) {
      return cause::BelowLimit{axis, target * kDegPerRad, limit.min_rad * kDegPerRad};
    }
    if (target > limit.max_rad) {
      return cause::AboveLimit{axis, target * kDegPerRad, limit.max_rad * kDegPerRad};
    }
  }
  return std::nullopt;
}

std::optional<Cause> object_to(const Move& move, std::span<const AxisLimit> limits,
                               std::span<const double> correction_limit_deg,
                               const AxisAngles& base_rad) {
  if (const auto objection = object_to(move, limits)) return objection;
  for (std::size_t i = 0; i < limits.size(); ++i) {
    const double correction_deg = (move.target_rad[i] - base_rad[i]) * kDegPerRad;
    if (std::abs(correction_deg) > correction_limit_deg[i]) {
      return cause::CorrectionLimit{static_cast<std::uint8_t>(i), correction_deg,
                                    correction_limit_deg[i]};
    }
  }
  return std::nullopt;
}

}  // namespace cellcal::drivers
