#pragma once
// Jerk-limited motion (double-S) of one scalar in closed form: between speeds, and from any state
// to a lower speed or to rest.
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

/// Time-optimal change between two speeds within the limits, without acceleration at either end.
double ramp_duration_s(double from_speed, double to_speed, const ScalarLimits& limits);
double ramp_distance(double from_speed, double to_speed, const ScalarLimits& limits);
/// Highest speed up to `cap` that can be reached in this way within `distance` from `from_speed`,
/// or, equivalently, from which that can be reached.
double reachable_speed(double from_speed, double distance, double cap, const ScalarLimits& limits);

/// Pieces of constant jerk.
class ScalarProfile {
 public:
  /// At rest at 0.
  ScalarProfile() = default;
  /// Time-optimal within the limits from rest at 0 to rest at `distance` >= 0.
  static ScalarProfile travel(double distance, const ScalarLimits& limits);
  /// From `state` (speed >= 0) to rest, as soon as acceleration and jerk limits allow.
  static ScalarProfile brake(const ScalarState& state, const ScalarLimits& limits);
  /// Starts in `state`; pieces are appended.
  explicit ScalarProfile(const ScalarState& state) : end_(state) {}

  /// Appends motion to `position`, ahead of the end, with `end_speed` there and no acceleration at
  /// either end. `end_speed` has to be reachable (reachable_speed).
  void travel_to(double position, double end_speed, const ScalarLimits& limits);
  /// Appends motion at constant speed to `position`.
  void cruise_to(double position);
  /// Appends a change to `end_speed`, at most the speed after reducing the acceleration to zero
  /// immediately.
  void slow(double end_speed, const ScalarLimits& limits);
  /// Sets the exact end position, removing rounding of the sums.
  void end_at(double position) { end_.position = position; }

  double duration_s() const { return duration_s_; }
  const ScalarState& end() const { return end_; }
  /// Before 0 the state at 0; from the duration on the exact end.
  ScalarState at(double t_s) const;
  double jerk_at(double t_s) const;

 private:
  struct Piece {
    double duration_s, jerk;
    ScalarState start;
  };
  // Per leg of a path and the corner after it: at most seven and one, or in a brake three and three
  // per stage.
  static constexpr std::size_t kMostPieces = 15 * (kMaxVias + 1);

  void append(double duration_s, double jerk);
  void append_ramp(double to_speed, const ScalarLimits& limits);
  void travel_from_rest(double distance, const ScalarLimits& limits);
  const Piece& piece_at(double& t_s) const;

  boost::container::static_vector<Piece, kMostPieces> pieces_;
  double duration_s_ = 0.0;
  ScalarState end_;
};

// Bisection of an interval.

/// `holds` is true from `from` up to some value towards `to`, and false beyond: returns that value,
/// on the side where it is true; `from` if it is true nowhere else.
template <typename Holds>
double last_where(double from, double to, Holds holds) {
  constexpr int kHalvings = 52;  // full precision of a double
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = from + (to - from) / 2;
    (holds(middle) ? from : to) = middle;
  }
  return from;
}

}  // namespace cellcal::drivers
