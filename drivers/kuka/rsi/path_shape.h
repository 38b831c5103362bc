#pragma once
// The way of a move in joint space: straight legs between way-points, and round corners between
// legs.
//
// It runs on one scalar s. On a leg q = from + (s - start) * along; a leg is as long in s as the
// slowest of its axes takes at its speed limit, in units of the first leg's time, so a path of one
// leg has s from 0 to 1. Each axis' limits divided by its share of the leg become limits of s.
//
// A corner of half length e between legs with directions d and d' begins at s = e before the
// way-point, ends at e behind it, and has dq/ds = d + (d' - d) * sigma(u), u from 0 to 1 over it.
// sigma grows from 0 to 1, its slope up from zero within a share `ramp` of u, level, and down again,
// and it is its own mirror image. So
//   - it leaves one leg and joins the next exactly, dq/ds and d2q/ds2 are continuous;
//   - it stays within the triangle of those two points and the way-point: with S the integral of
//     sigma, convex from 0 to 1/2, the shares of d and d' in the way are a = 2u - 2S(u) and
//     b = 2S(u), and 0 <= b <= a <= 1;
//   - no axis is faster than on one of the two legs, and no speed limit is passed while ds/dt
//     keeps those of both.

#include <array>
#include <boost/container/static_vector.hpp>
#include <span>

#include "drivers/kuka/rsi/motion.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

inline constexpr std::size_t kMaxLegs = kMaxVias + 1;
inline constexpr std::size_t kBrakeStages = 4;
/// Shorter than this no axis moves: a thousandth of what six decimals of a degree can say.
inline constexpr double kNoTravelRad = 1e-11;

struct PathLeg {
  AxisAngles from_rad, along_rad;    ///< along: way per unit of s
  double start = 0.0, length = 0.0;  ///< in s, from way-point to way-point
  double fastest_rad = 0.0;          ///< of `along`, its largest
  ScalarLimits limits;
};

/// Between legs i and i + 1.
struct PathCorner {
  double longest = 0.0;  ///< that half length may be
  double half = 0.0;     ///< 0: rest
  double ramp = 0.5;     ///< of sigma's slope, up to 0.5
  double speed = 0.0;    ///< ds/dt, constant in the corner
  /// Limits of s for a brake from these speeds, falling from `speed`; their speed is no limit. The
  /// slower, the less the bend asks for, and the harder it may be.
  struct Brake {
    double from_speed = 0.0;
    ScalarLimits limits;
  };
  std::array<Brake, kBrakeStages> brakes{};
};

class PathShape {
 public:
  /// No way at all.
  PathShape() = default;
  /// A leg on which no axis moves is none, and what is passed there is a rest.
  PathShape(const AxisAngles& from_rad, const Vias& vias, const AxisAngles& to_rad,
            std::span<const AxisLimit> limits);

  std::size_t legs() const { return legs_.size(); }
  const PathLeg& leg(std::size_t i) const { return legs_[i]; }
  PathLeg& leg(std::size_t i) { return legs_[i]; }
  const PathCorner& corner(std::size_t i) const { return corners_[i]; }
  PathCorner& corner(std::size_t i) { return corners_[i]; }
  /// Where the straight part of a leg begins and ends.
  double straight_begin(std::size_t leg) const;
  double straight_end(std::size_t leg) const;
  /// On the first leg that was asked for; otherwise leg(0) is a later one, or there is none.
  bool first_leg_moves() const { return first_leg_moves_; }

  struct Place {
    std::size_t leg = 0;
    bool in_corner = false;  ///< in the one behind that leg
  };
  Place place(double s) const;

  AxisAngles at(double s) const;
  /// Largest |dq/ds| of an axis.
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

}  // namespace cellcal::drivers
