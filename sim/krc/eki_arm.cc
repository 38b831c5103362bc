#include "sim/krc/eki_arm.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace cellcal::sim {

EkiArm::EkiArm(std::vector<double> start_rad, double lag_s)
    : lag_s_(lag_s), from_(start_rad), to_(start_rad), setpoint_(start_rad), actual_(start_rad) {}

void EkiArm::go(const std::vector<double>& target_rad, double speed, double acceleration) {
  from_ = setpoint_;
  to_ = target_rad;
  fraction_ = speed_ = 0.0;
  full_speed_ = speed;
  acceleration_ = acceleration;
  braking_ = false;
  moving_ = true;
}

void EkiArm::brake(double deceleration) {
  acceleration_ = braking_ ? std::max(acceleration_, deceleration) : deceleration;
  braking_ = true;
}

std::vector<double> EkiArm::actual_at(drivers::TimePoint t) const {
  const double dt = std::max(0.0, std::chrono::duration<double>(t - tick_at_).count());
  const double moved = -std::expm1(-dt / lag_s_);
  std::vector<double> position = actual_;
  for (std::size_t i = 0; i < position.size(); ++i) {
    position[i] += moved * (setpoint_[i] - actual_[i]);
  }
  return position;
}

void EkiArm::tick(drivers::TimePoint now, double dt_s) {
  if (ticked_) actual_ = actual_at(now);
  ticked_ = true;
  tick_at_ = now;
  if (creep_per_s_ != 0.0)
    for (std::vector<double>* all : {&from_, &to_, &setpoint_, &actual_})
      (*all)[creeping_] += creep_per_s_ * dt_s;
  if (!moving_) return;
  const double wanted = braking_ ? 0.0 : full_speed_ * scale_;
  const double step = acceleration_ * dt_s;
  speed_ = std::clamp(wanted, speed_ - step, speed_ + step);
  const double left = 1.0 - fraction_;
  // With discrete steps the ramp to the target has to begin one step early.
  const double still_stops = std::sqrt(std::max(0.0, 2.0 * acceleration_ * left)) - 0.5 * step;
  if (!braking_) speed_ = std::min(speed_, std::max(still_stops, step));
  if (speed_ * dt_s >= left) {
    fraction_ = 1.0;
    speed_ = 0.0;
    moving_ = false;
  } else {
    fraction_ += speed_ * dt_s;
    if (braking_ && speed_ <= 0.0) moving_ = false;
  }
  for (std::size_t i = 0; i < setpoint_.size(); ++i) {
    setpoint_[i] = from_[i] + fraction_ * (to_[i] - from_[i]);
  }
  if (fraction_ >= 1.0) setpoint_ = to_;
}

void EkiArm::place(const std::vector<double>& pose_rad) {
  from_ = to_ = setpoint_ = actual_ = pose_rad;
  moving_ = false;
}

}  // namespace cellcal::sim
