#pragma once
// A move through way-points without stops, and the special case of one straight line: the way of a
// PathShape, run on jerk-limited profiles. No allocation.
//
// Legs are double-S from one corner's speed to the next one's, corners are passed at constant
// speed, so every axis keeps its limits. A brake keeps them as well, wherever it begins, and each
// leg and corner by itself: either it ends there, or it comes to the end of it without acceleration
// and at the lowest speed that can be had so. That is never faster than the move would have been.
// In a corner it goes in stages where that is sooner: from lower speeds it may be harder.

#include <span>

#include "drivers/kuka/rsi/motion.h"
#include "drivers/kuka/rsi/path_shape.h"

namespace cellcal::drivers {

class PathMove {
 public:
  PathMove() = default;
  /// `cruise_s`: duration at constant speed as if there were no ramps (0: none asked for); only
  /// without way-points.
  PathMove(const AxisAngles& from_rad, const AxisAngles& to_rad, std::span<const AxisLimit> limits,
           double cruise_s, const Vias& vias = {});

  double duration_s() const { return profile_.duration_s(); }
  /// At and after the duration the exact target, unless braked.
  AxisAngles at(double t_s) const;
  /// Speed of the fastest axis [rad/s].
  double fastest_axis_rad_s(double t_s) const;
  /// From t on: stop on the same path as soon as the limits allow. Time starts at 0 again.
  void brake_at(double t_s);
  /// Likewise within `longest_s`, beyond the limits if it must be.
  void brake_within(double t_s, double longest_s);
  /// When it leaves the first leg, or rests at its end.
  double first_leg_s() const { return shape_.first_leg_moves() ? ends_s_.front() : 0.0; }

  const PathShape& shape() const { return shape_; }
  const ScalarProfile& profile() const { return profile_; }

 private:
  void run();
  double duration_with_rests_s() const;
  double speed_behind(std::size_t leg) const;
  struct Stage {
    double to_speed = 0.0;
    ScalarLimits limits;
  };
  Stage stage_at(PathShape::Place place, double speed) const;
  PathShape::Place place_at(double t_s) const;
  ScalarProfile stop_from(const ScalarState& state, PathShape::Place place, bool in_stages) const;

  AxisAngles from_rad_, to_rad_;
  PathShape shape_;
  ScalarProfile profile_;
  /// When each leg ends, and each corner behind it. Not by s: that may round into the next one,
  /// whose limits are others.
  boost::container::static_vector<double, 2 * kMaxLegs> ends_s_;
  bool braked_ = false;
};

}  // namespace cellcal::drivers
