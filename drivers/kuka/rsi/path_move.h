#pragma once
// A move through way-points without stops, including the special case of one straight line: a
// PathShape travelled with jerk-limited profiles. No allocation.
//
// Legs are double-S from one corner's speed to the next one's, corners are passed at constant
// speed, so that every axis keeps its limits. A brake keeps them as well, at any time, separately
// on each leg and corner: it either ends there, or reaches its end without acceleration at the
// lowest possible speed, which is never above the speed of the move. In a corner it proceeds in
// stages if that is faster: braking may be harder at lower speeds.

#include <span>

#include "drivers/kuka/rsi/motion.h"
#include "drivers/kuka/rsi/path_shape.h"

namespace cellcal::drivers {

class PathMove {
 public:
  PathMove() = default;
  /// `cruise_s`: duration at constant speed, ramps excluded (0: unspecified); only without
  /// way-points.
  PathMove(const AxisAngles& from_rad, const AxisAngles& to_rad, std::span<const AxisLimit> limits,
           double cruise_s, const Vias& vias = {});

  double duration_s() const { return profile_.duration_s(); }
  /// From the duration on the exact target, unless braked.
  AxisAngles at(double t_s) const;
  /// Speed of the fastest axis [rad/s].
  double fastest_axis_rad_s(double t_s) const;
  /// From t on: stops on the same path as soon as the limits allow. Time restarts at 0.
  void brake_at(double t_s);
  /// As brake_at(), within `longest_s`, exceeding the limits if necessary.
  void brake_within(double t_s, double longest_s);
  /// Time at which it leaves the first leg, or rests at its end.
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
  /// End of each leg, and of each corner after it. Not derived from s, which may round into the
  /// next one with different limits.
  boost::container::static_vector<double, 2 * kMaxLegs> ends_s_;
  bool braked_ = false;
};

}  // namespace cellcal::drivers
