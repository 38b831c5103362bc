#pragma once
// Jerk-limited travel (double-S) in closed form on one scalar: from speed to speed, and from any
// state to a lower speed or to rest.
//
// Source of the double-S: Biagiotti, Melchiorri, Trajectory Planning for Automatic Machines and
// Robots, 3.4.

#include <boost/container/static_vector.hpp>

#include "drivers/robot.h"

namespace cellcal::drivers {

struct ScalarLimits {
  double speed = 0.0, acceleration = 0.0, jerk = 0.0;  // unit/s, unit/s^2, unit/s^3; positive
};

struct ScalarState {
  double position = 0.0, speed = 0.0, acceleration = 0.0;
};

/// From one speed to another without acceleration at either end, as fast as the limits allow.
double ramp_duration_s(double from_speed, double to_speed, const ScalarLimits& limits);
double ramp_distance(double from_speed, double to_speed, const ScalarLimits& limits);
/// The highest speed up to `cap` that can be reached so within `distance` from `from_speed`; or
/// from which that can be reached, which is the same.
double reachable_speed(double from_speed, double distance, double cap, const ScalarLimits& limits);

/// Pieces of constant jerk.
class ScalarProfile {
 public:
  /// Stands at 0.
  ScalarProfile() = default;
  /// From rest at 0 to rest at `distance` >= 0, as fast as the limits allow.
  static ScalarProfile travel(double distance, const ScalarLimits& limits);
  /// From `state` (speed >= 0) to rest, as soon as acceleration and jerk limits allow.
  static ScalarProfile brake(const ScalarState& state, const ScalarLimits& limits);
  /// In `state`; what follows is appended.
  explicit ScalarProfile(const ScalarState& state) : end_(state) {}

  /// On to `position`, not behind the end, and `end_speed` there, no acceleration at either end.
  /// `end_speed` has to be within reach (reachable_speed).
  void travel_to(double position, double end_speed, const ScalarLimits& limits);
  /// On at the speed that it has, to `position`.
  void cruise_to(double position);
  /// On to `end_speed`, at most what it comes to when the acceleration is taken back at once.
  void slow(double end_speed, const ScalarLimits& limits);
  /// The end is exactly here: what the sums are but for rounding.
  void end_at(double position) { end_.position = position; }

  double duration_s() const { return duration_s_; }
  const ScalarState& end() const { return end_; }
  /// Before 0 the state at 0; at and after the duration the exact end.
  ScalarState at(double t_s) const;
  double jerk_at(double t_s) const;

 private:
  struct Piece {
    double duration_s, jerk;
    ScalarState start;
  };
  // For each leg of a path and the corner behind it: at most seven and one, or in a brake three and
  // three for each of its stages.
  static constexpr std::size_t kMostPieces = 15 * (kMaxVias + 1);

  void append(double duration_s, double jerk);
  void append_ramp(double to_speed, const ScalarLimits& limits);
  void travel_from_rest(double distance, const ScalarLimits& limits);
  const Piece& piece_at(double& t_s) const;

  boost::container::static_vector<Piece, kMostPieces> pieces_;
  double duration_s_ = 0.0;
  ScalarState end_;
};

}  // namespace cellcal::drivers
