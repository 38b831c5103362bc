#include "drivers/kuka/rsi/reply_bound.h"

#include <algorithm>
#include <cmath>

#include "drivers/units.h"

namespace cellcal::drivers {

namespace {

// Tolerance for rounding of sums and the choice of corners on a path within its limits.
constexpr double kMargin = 1.01;
constexpr double kRoundingRad = 1e-9;

double of(const AxisAngles& values, std::size_t i) { return i < values.size() ? values[i] : 0.0; }

}  // namespace

std::optional<cause::ReplyBeyondLimit> ReplyBound::admit(const AxisAngles& next_rad, double cycle_s,
                                                         bool stops) {
  using Of = cause::ReplyBeyondLimit::Of;
  Said next{next_rad, next_rad, next_rad, cycle_s, last_.cycle_s};
  const double two_s = cycle_s + (last_.cycle_s > 0.0 ? last_.cycle_s : cycle_s);
  const double three_s = two_s + (last_.before_s > 0.0 ? last_.before_s : cycle_s);
  for (std::size_t i = 0; i < next_rad.size(); ++i) {
    const AxisLimit& limit = limits_[i];
    const double step = next_rad[i] - last_.at_rad[i];
    if (std::abs(step) <= kRoundingRad && of(last_.speed, i) == 0.0) {
      next.speed[i] = next.acceleration[i] = 0.0;
      continue;
    }
    const auto beyond = [&](Of of, double value, double most) {
      return cause::ReplyBeyondLimit{of, static_cast<std::uint8_t>(i), value * kDegPerRad,
                                     most * kDegPerRad};
    };
    // No motion before the cycle is known.
    if (!(cycle_s > 0.0)) return beyond(Of::kSpeed, HUGE_VAL, limit.max_speed_rad_s);
    const double was = of(last_.speed, i);
    const double speed = next.speed[i] = step / cycle_s;
    const double change = next.acceleration[i] = 2.0 * (speed - was) / two_s;
    const double jerk = 3.0 * (change - of(last_.acceleration, i)) / three_s;
    const double least = kRoundingRad / cycle_s;
    if (!(std::abs(speed) <= kMargin * limit.max_speed_rad_s + least))
      return beyond(Of::kSpeed, std::abs(speed), limit.max_speed_rad_s);
    if (stops && speed * was >= 0.0 && std::abs(speed) <= std::abs(was) + least) continue;
    if (!(std::abs(change) <= kMargin * limit.max_acceleration_rad_s2 + least / cycle_s))
      return beyond(Of::kAcceleration, std::abs(change), limit.max_acceleration_rad_s2);
    if (!stops &&
        !(std::abs(jerk) <= kMargin * limit.max_jerk_rad_s3 + 4 * least / (cycle_s * cycle_s)))
      return beyond(Of::kJerk, std::abs(jerk), limit.max_jerk_rad_s3);
  }
  before_ = last_;
  last_ = next;
  return std::nullopt;
}

}  // namespace cellcal::drivers
