#include "drivers/kuka/rsi/motion.h"

#include <algorithm>
#include <cmath>

namespace cellcal::drivers {
namespace {

// Shorter than this no axis moves: a thousandth of what six decimals of a degree can say.
constexpr double kNoTravelRad = 1e-11;

ScalarState after(const ScalarState& start, double jerk, double t) {
  return {start.position + t * (start.speed + t * (start.acceleration / 2 + t * jerk / 6)),
          start.speed + t * (start.acceleration + t * jerk / 2), start.acceleration + t * jerk};
}

}  // namespace

void ScalarProfile::append(double duration_s, double jerk) {
  if (duration_s <= 0.0) return;
  pieces_.push_back({duration_s, jerk, end_});
  end_ = after(end_, jerk, duration_s);
  duration_s_ += duration_s;
}

ScalarProfile ScalarProfile::travel(double distance, const ScalarLimits& limits) {
  const auto [v, a, j] = limits;
  ScalarProfile profile;
  if (distance <= 0.0) return profile;
  // Ramp to full speed: with or without a phase of constant acceleration.
  double jerk_s = v * j >= a * a ? a / j : std::sqrt(v / j);
  double ramp_s = v * j >= a * a ? jerk_s + v / a : 2 * jerk_s;
  double cruise_s = distance / v - ramp_s;
  if (cruise_s < 0.0) {  // full speed is not reached
    cruise_s = 0.0;
    if (distance >= 2 * a * a * a / (j * j)) {
      jerk_s = a / j;
      ramp_s = jerk_s / 2 + std::sqrt(jerk_s * jerk_s / 4 + distance / a);
    } else {
      jerk_s = std::cbrt(distance / (2 * j));
      ramp_s = 2 * jerk_s;
    }
  }
  const double level_s = ramp_s - 2 * jerk_s;
  profile.append(jerk_s, j);
  profile.append(level_s, 0.0);
  profile.append(jerk_s, -j);
  profile.append(cruise_s, 0.0);
  profile.append(jerk_s, -j);
  profile.append(level_s, 0.0);
  profile.append(jerk_s, j);
  profile.end_ = {distance, 0.0, 0.0};  // what the sums are but for rounding
  return profile;
}

ScalarProfile ScalarProfile::brake(const ScalarState& state, const ScalarLimits& limits) {
  const double a = limits.acceleration, j = limits.jerk;
  const double v0 = std::max(0.0, state.speed), a0 = state.acceleration;
  ScalarProfile profile;
  profile.end_ = state;
  // Deceleration rises to `peak` and falls back to zero just as the speed does.
  double peak = std::sqrt(std::max(0.0, j * v0 + a0 * a0 / 2));
  double hold_s = 0.0;
  if (peak > a) {
    peak = a;
    hold_s = (v0 + a0 * a0 / (2 * j) - peak * peak / j) / peak;
  }
  // Within a stop already, the first phase is over, and only rounding could ask for some of it.
  profile.append(std::max(0.0, a0 + peak) / j, -j);
  profile.append(hold_s, 0.0);
  profile.append(peak / j, j);
  profile.end_.speed = profile.end_.acceleration = 0.0;
  return profile;
}

ScalarState ScalarProfile::at(double t_s) const {
  if (t_s >= duration_s_ || pieces_.empty()) return end_;
  t_s = std::max(0.0, t_s);
  std::size_t i = 0;
  while (i + 1 < pieces_.size() && t_s >= pieces_[i].duration_s) t_s -= pieces_[i++].duration_s;
  return after(pieces_[i].start, pieces_[i].jerk, t_s);
}

LineMove::LineMove(const AxisAngles& from_rad, const AxisAngles& to_rad,
                   std::span<const AxisLimit> limits, double cruise_s)
    : from_rad_(from_rad), to_rad_(to_rad) {
  limits_ = {HUGE_VAL, HUGE_VAL, HUGE_VAL};
  for (std::size_t i = 0; i < from_rad.size(); ++i) {
    const double share = std::abs(to_rad[i] - from_rad[i]);
    longest_rad_ = std::max(longest_rad_, share);
    if (share < kNoTravelRad) continue;
    limits_.speed = std::min(limits_.speed, limits[i].max_speed_rad_s / share);
    limits_.acceleration =
        std::min(limits_.acceleration, limits[i].max_acceleration_rad_s2 / share);
    limits_.jerk = std::min(limits_.jerk, limits[i].max_jerk_rad_s3 / share);
  }
  if (longest_rad_ < kNoTravelRad) return;
  if (cruise_s > 0.0) limits_.speed = std::min(limits_.speed, 1.0 / cruise_s);
  profile_ = ScalarProfile::travel(1.0, limits_);
}

AxisAngles LineMove::at(double t_s) const {
  if (!braked_ && t_s >= profile_.duration_s()) return to_rad_;
  const double s = profile_.at(t_s).position;
  AxisAngles angles = from_rad_;
  for (std::size_t i = 0; i < angles.size(); ++i) angles[i] += s * (to_rad_[i] - from_rad_[i]);
  return angles;
}

double LineMove::fastest_axis_rad_s(double t_s) const {
  return std::abs(profile_.at(t_s).speed) * longest_rad_;
}

void LineMove::brake_at(double t_s) {
  if (longest_rad_ < kNoTravelRad) return;
  profile_ = ScalarProfile::brake(profile_.at(t_s), limits_);
  braked_ = true;
}

void LineMove::brake_within(double t_s, double longest_s) {
  constexpr double kHarder = 1.2;
  const ScalarState state = profile_.at(t_s);
  brake_at(t_s);
  for (ScalarLimits limits = limits_; braked_ && duration_s() > longest_s;) {
    limits.acceleration *= kHarder;
    limits.jerk *= kHarder;
    profile_ = ScalarProfile::brake(state, limits);
  }
}

}  // namespace cellcal::drivers
