#pragma once
// Jerk-limited travel (double-S) in closed form, from rest to rest and from any state to rest.
//
// A straight joint-space line runs on one scalar 0..1; each axis' limits divided by its share of
// the line become limits of the scalar, so every axis keeps its own. Source of the double-S:
// Biagiotti, Melchiorri, Trajectory Planning for Automatic Machines and Robots, 3.4.

#include <boost/container/static_vector.hpp>
#include <span>

#include "drivers/robot.h"

namespace cellcal::drivers {

struct ScalarLimits {
  double speed = 0.0, acceleration = 0.0, jerk = 0.0;  // unit/s, unit/s^2, unit/s^3; positive
};

struct ScalarState {
  double position = 0.0, speed = 0.0, acceleration = 0.0;
};

/// Pieces of constant jerk.
class ScalarProfile {
 public:
  /// Empty: stands at 0.
  ScalarProfile() = default;
  /// From rest at 0 to rest at `distance` >= 0, as fast as the limits allow.
  static ScalarProfile travel(double distance, const ScalarLimits& limits);
  /// From `state` (speed >= 0) to rest, as soon as acceleration and jerk limits allow.
  static ScalarProfile brake(const ScalarState& state, const ScalarLimits& limits);

  double duration_s() const { return duration_s_; }
  /// Before 0 the state at 0; at and after the duration the exact end, at rest.
  ScalarState at(double t_s) const;

 private:
  struct Piece {
    double duration_s, jerk;
    ScalarState start;
  };
  void append(double duration_s, double jerk);

  boost::container::static_vector<Piece, 7> pieces_;
  double duration_s_ = 0.0;
  ScalarState end_;
};

/// A move along a straight line in joint space.
class LineMove {
 public:
  LineMove() = default;
  /// `cruise_s`: duration at constant speed as if there were no ramps (0: none asked for).
  LineMove(const AxisAngles& from_rad, const AxisAngles& to_rad, std::span<const AxisLimit> limits,
           double cruise_s);

  double duration_s() const { return profile_.duration_s(); }
  /// At and after the duration the exact target, unless braked.
  AxisAngles at(double t_s) const;
  /// Speed of the fastest axis [rad/s].
  double fastest_axis_rad_s(double t_s) const;
  /// From t on: stop on the same line as soon as the limits allow. Time starts at 0 again.
  void brake_at(double t_s);
  /// Likewise within `longest_s`, beyond the limits if it must be.
  void brake_within(double t_s, double longest_s);

 private:
  AxisAngles from_rad_, to_rad_;
  double longest_rad_ = 0.0;
  ScalarLimits limits_;
  ScalarProfile profile_;
  bool braked_ = false;
};

}  // namespace cellcal::drivers
