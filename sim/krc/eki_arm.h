#pragma once
// An arm moved by the controller: straight lines in joint space with a trapezoidal speed, brake
// ramps, and a lag between setpoint and arm.
//
// Model: LIN is a straight line in joint space, too. Over a search of 25 mm the real path deviates
// from it by micrometres, and only the latched position is used. After a stop the arm rests where
// its ramp ended.

#include <vector>

#include "drivers/time.h"

namespace cellcal::sim {

class EkiArm {
 public:
  EkiArm(std::vector<double> start_rad, double lag_s);

  /// Speed and acceleration of the line's fraction [1/s, 1/s^2]. Only at rest.
  void go(const std::vector<double>& target_rad, double speed, double acceleration);
  /// Ramp to rest on the same line [1/s^2]. An active ramp can only be steepened.
  void brake(double deceleration);
  /// 0 to 1 of the line's speed; 0 holds it, a later increase continues it.
  void scale(double factor) { scale_ = factor; }
  bool at_rest() const { return !moving_; }
  bool arrived() const { return !moving_ && fraction_ >= 1.0; }

  /// The next setpoint, effective from `now` for `dt_s`.
  void tick(drivers::TimePoint now, double dt_s);
  /// From the last tick up to the next.
  std::vector<double> actual_at(drivers::TimePoint t) const;
  const std::vector<double>& setpoint() const { return setpoint_; }
  void place(const std::vector<double>& pose_rad);
  /// A fault: moves the axis at this speed whatever is commanded; 0 ends it.
  void creep(std::size_t axis, double per_s) { creeping_ = axis, creep_per_s_ = per_s; }

 private:
  double lag_s_;
  std::vector<double> from_, to_, setpoint_, actual_;
  double fraction_ = 1.0, speed_ = 0.0;
  double full_speed_ = 0.0, acceleration_ = 0.0, scale_ = 1.0;
  std::size_t creeping_ = 0;
  double creep_per_s_ = 0.0;
  bool moving_ = false, braking_ = false, ticked_ = false;
  drivers::TimePoint tick_at_{};
};

}  // namespace cellcal::sim
