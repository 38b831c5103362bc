#include "drivers/kuka/rsi/motion.h"

#include <algorithm>
#include <cmath>

namespace cellcal::drivers {
namespace {

ScalarState after(const ScalarState& start, double jerk, double t) {
  return {start.position + t * (start.speed + t * (start.acceleration / 2 + t * jerk / 6)),
          start.speed + t * (start.acceleration + t * jerk / 2), start.acceleration + t * jerk};
}

/// Highest speed between two speeds over a sufficiently long distance.
double peak_speed(double from, double to, double distance, const ScalarLimits& limits) {
  const auto fits = [&](double peak) {
    return ramp_distance(from, peak, limits) + ramp_distance(peak, to, limits) <= distance;
  };
  const double least = std::max(from, to);
  return fits(limits.speed) ? limits.speed : last_where(least, limits.speed, fits);
}

}  // namespace

double ramp_duration_s(double from_speed, double to_speed, const ScalarLimits& limits) {
  const auto [v, a, j] = limits;
  const double change = std::abs(to_speed - from_speed);
  return change * j >= a * a ? change / a + a / j : 2 * std::sqrt(change / j);
}

double ramp_distance(double from_speed, double to_speed, const ScalarLimits& limits) {
  return (from_speed + to_speed) / 2 * ramp_duration_s(from_speed, to_speed, limits);
}

double reachable_speed(double from_speed, double distance, double cap, const ScalarLimits& limits) {
  const auto fits = [&](double speed) {
    return ramp_distance(from_speed, speed, limits) <= distance;
  };
  if (cap <= from_speed || fits(cap)) return cap;
  return last_where(from_speed, cap, fits);
}

void ScalarProfile::append(double duration_s, double jerk) {
  if (duration_s <= 0.0) return;
  pieces_.push_back({duration_s, jerk, end_});
  end_ = after(end_, jerk, duration_s);
  duration_s_ += duration_s;
}

void ScalarProfile::append_ramp(double to_speed, const ScalarLimits& limits) {
  const double a = limits.acceleration;
  const double change = to_speed - end_.speed, most = std::abs(change);
  const double jerk = std::copysign(limits.jerk, change);
  const double jerk_s =
      most * limits.jerk >= a * a ? a / limits.jerk : std::sqrt(most / limits.jerk);
  append(jerk_s, jerk);
  append(most * limits.jerk >= a * a ? most / a - jerk_s : 0.0, 0.0);
  append(jerk_s, -jerk);
  end_.speed = to_speed;
  end_.acceleration = 0.0;
}

void ScalarProfile::travel_from_rest(double distance, const ScalarLimits& limits) {
  const auto [v, a, j] = limits;
  if (distance <= 0.0) return;
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
  append(jerk_s, j);
  append(level_s, 0.0);
  append(jerk_s, -j);
  append(cruise_s, 0.0);
  append(jerk_s, -j);
  append(level_s, 0.0);
  append(jerk_s, j);
  end_.speed = end_.acceleration = 0.0;
}

void ScalarProfile::travel_to(double position, double end_speed, const ScalarLimits& limits) {
  const double distance = position - end_.position;
  if (end_.speed == 0.0 && end_speed == 0.0) {
    travel_from_rest(distance, limits);
  } else {
    const double peak = peak_speed(end_.speed, end_speed, distance, limits);
    const double ramps =
        ramp_distance(end_.speed, peak, limits) + ramp_distance(peak, end_speed, limits);
    append_ramp(peak, limits);
    append((distance - ramps) / peak, 0.0);
    append_ramp(end_speed, limits);
  }
  end_.position = position;
}

void ScalarProfile::cruise_to(double position) {
  append((position - end_.position) / end_.speed, 0.0);
  end_.position = position;
}

void ScalarProfile::slow(double end_speed, const ScalarLimits& limits) {
  const double a = limits.acceleration, j = limits.jerk;
  const double v0 = end_speed > 0.0 ? end_.speed - end_speed : std::max(0.0, end_.speed);
  const double a0 = end_.acceleration;
  // Deceleration increases to `peak` and returns to zero exactly at the final speed.
  double peak = std::sqrt(std::max(0.0, j * v0 + a0 * a0 / 2));
  double hold_s = 0.0;
  if (peak > a) {
    peak = a;
    hold_s = (v0 + a0 * a0 / (2 * j) - peak * peak / j) / peak;
  }
  // During a stop the first phase has elapsed, except for rounding.
  append(std::max(0.0, a0 + peak) / j, -j);
  append(hold_s, 0.0);
  append(peak / j, j);
  end_.speed = end_speed;
  end_.acceleration = 0.0;
}

ScalarProfile ScalarProfile::travel(double distance, const ScalarLimits& limits) {
  ScalarProfile profile;
  if (distance > 0.0) profile.travel_to(distance, 0.0, limits);
  return profile;
}

ScalarProfile ScalarProfile::brake(const ScalarState& state, const ScalarLimits& limits) {
  ScalarProfile profile(state);
  profile.slow(0.0, limits);
  return profile;
}

const ScalarProfile::Piece& ScalarProfile::piece_at(double& t_s) const {
  t_s = std::max(0.0, t_s);
  std::size_t i = 0;
  while (i + 1 < pieces_.size() && t_s >= pieces_[i].duration_s) t_s -= pieces_[i++].duration_s;
  return pieces_[i];
}

ScalarState ScalarProfile::at(double t_s) const {
  if (t_s >= duration_s_ || pieces_.empty()) return end_;
  const Piece& piece = piece_at(t_s);
  return after(piece.start, piece.jerk, t_s);
}

double ScalarProfile::jerk_at(double t_s) const {
  return t_s >= duration_s_ || pieces_.empty() ? 0.0 : piece_at(t_s).jerk;
}

}  // namespace cellcal::drivers
