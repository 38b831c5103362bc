#pragma once
// A move through way-points without stops, including the special case of one straight line: a
// PathShape travelled with jerk-limited profiles. No allocation.
//
// Legs are double-S from one corner's speed to the next one's, corners are passed at constant
// speed, so that every axis keeps its limits. A brake keeps them as well, at any time, separately
// on each leg and corner: it either ends there, or reaches its end without acceleration at the
// lowest possible speed, which is never above the speed of the move. In a corner it proceeds in
// stages if that is faster: braking may be harder at lower speeds.

#include <array>
#include <boost/container/static_vector.hpp>
#include <span>

#include "drivers/kuka/rsi/motion.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

// Path of a move in joint space: straight legs between way-points, and rounded corners between legs.
//
// It is parametrised by one scalar s. On a leg q = from + (s - start) * along; the length of a leg
// in s is the time of its slowest axis at its speed limit, in units of the first leg's time, so a
// path of one leg has s from 0 to 1. Each axis' limits divided by its share of the leg become limits
// of s.
//
// A corner of half length e between legs with directions d and d' begins at s = e before the
// way-point, ends at e after it, and has dq/ds = d + (d' - d) * sigma(u), u from 0 to 1 over it.
// sigma increases from 0 to 1; its slope rises from zero within a share `ramp` of u, is constant,
// and falls again, point-symmetrically. Therefore
//   - it leaves one leg and joins the next exactly, dq/ds and d2q/ds2 are continuous;
//   - it stays within the triangle of those two points and the way-point: with S the integral of
//     sigma, convex from 0 to 1/2, the shares of d and d' in the path are a = 2u - 2S(u) and
//     b = 2S(u), and 0 <= b <= a <= 1;
//   - no axis is faster than on one of the two legs, and no speed limit is exceeded while ds/dt
//     keeps those of both.

inline constexpr std::size_t kMaxLegs = kMaxVias + 1;
inline constexpr std::size_t kBrakeStages = 4;
/// Travel below which an axis does not move: a thousandth of the resolution of six decimals of a
/// degree.
inline constexpr double kNoTravelRad = 1e-11;

struct PathLeg {
  AxisAngles from_rad, along_rad;    ///< along: dq/ds
  double start = 0.0, length = 0.0;  ///< in s, from way-point to way-point
  double fastest_rad = 0.0;          ///< largest component of `along`
  ScalarLimits limits;
};

/// Between legs i and i + 1.
struct PathCorner {
  double longest = 0.0;  ///< largest half length
  double half = 0.0;     ///< 0: rest
  double ramp = 0.5;     ///< of sigma's slope, up to 0.5
  double speed = 0.0;    ///< ds/dt, constant in the corner
  /// Limits of s for a brake from these speeds, decreasing from `speed`; the speed in them is not a
  /// limit. The lower the speed, the less the bend requires, and the harder the brake may be.
  struct Brake {
    double from_speed = 0.0;
    ScalarLimits limits;
  };
  std::array<Brake, kBrakeStages> brakes{};
};

class PathShape {
 public:
  /// Empty path.
  PathShape() = default;
  /// Legs without motion are dropped, and a way-point passed there is a rest.
  PathShape(const AxisAngles& from_rad, const Vias& vias, const AxisAngles& to_rad,
            std::span<const AxisLimit> limits);

  std::size_t legs() const { return legs_.size(); }
  const PathLeg& leg(std::size_t i) const { return legs_[i]; }
  PathLeg& leg(std::size_t i) { return legs_[i]; }
  const PathCorner& corner(std::size_t i) const { return corners_[i]; }
  PathCorner& corner(std::size_t i) { return corners_[i]; }
  /// Beginning and end of the straight part of a leg.
  double straight_begin(std::size_t leg) const;
  double straight_end(std::size_t leg) const;
  /// True if the requested first leg has motion; otherwise leg(0) is a later one, or there is none.
  bool first_leg_moves() const { return first_leg_moves_; }

  struct Place {
    std::size_t leg = 0;
    bool in_corner = false;  ///< in the corner after that leg
  };
  Place place(double s) const;

  AxisAngles at(double s) const;
  /// Largest |dq/ds| of any axis.
  double fastest_rad(double s) const;
  /// First, second or third derivative by s.
  AxisAngles derivative(int order, double s) const;

 private:
  double corner_share(std::size_t corner, double s) const;
  double bent(int order, std::size_t corner, double s) const;

  boost::container::static_vector<PathLeg, kMaxLegs> legs_;
  boost::container::static_vector<PathCorner, kMaxVias> corners_;
  bool first_leg_moves_ = false;
};

// Width and speed of each corner of a path, and the braking allowed in it.
//
// In a corner ds/dt = v is constant, unless the arm is brought to rest with at most a deceleration
// A and jerk J of s. With d -> d' the direction's change, M the larger of |d| and |d'|, half length
// e, ramps r of sigma's slope and h = 1 / (1 - r) its level, an axis then has at most
//
//   acceleration |d' - d| h v^2 / 2e + M A
//   jerk         |d' - d| h (v^3 / (4 r e^2) + 1.5 v A / e) + M J
//
// Both increase with v, so that values valid at the corner's speed are valid at any lower speed
// during a brake. The speed reserves at least A = kBrake v^2 / e and J = kBrakeJerk v^3 / e^2. That
// is little at the start of a brake, and more at lower speeds: it proceeds in stages.
//
// Speeds are chosen such that each leg can be travelled between its corners' speeds, at its limits
// and without acceleration at either end.

/// Sets half length, speed and brakes of every corner.
void choose_corners(PathShape& path, std::span<const AxisLimit> limits);
void rest_in_corners(PathShape& path);

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
  /// From t on: from rest there, along the same path. Time restarts at 0.
  void start_at(double t_s) { run(profile_.at(t_s).position, place_at(t_s)); }
  /// As brake_at(), within `longest_s`, exceeding the limits if necessary.
  void brake_within(double t_s, double longest_s);
  /// Time at which it leaves the first leg, or rests at its end.
  double first_leg_s() const { return shape_.first_leg_moves() ? ends_s_.front() : 0.0; }

  const PathShape& shape() const { return shape_; }
  const ScalarProfile& profile() const { return profile_; }

 private:
  void run(double from_s, PathShape::Place from);
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
