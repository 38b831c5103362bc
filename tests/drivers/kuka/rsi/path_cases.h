#pragma once
// Random paths, including degenerate ones, and the margin of a motion on them to its limits.

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "drivers/kuka/rsi/path_move.h"

namespace cellcal::drivers {

struct PathCase {
  AxisAngles from;
  Vias vias;
  AxisAngles to;
  std::vector<AxisLimit> limits;

  PathMove move() const { return PathMove(from, to, limits, 0.0, vias); }
  PathMove with_stops() const {
    Vias rests = vias;
    for (Via& via : rests) via.in_share = via.out_share = 0.0;
    return PathMove(from, to, limits, 0.0, rests);
  }
  const AxisAngles& point(std::size_t i) const {
    if (i == 0) return from;
    return i <= vias.size() ? vias[i - 1].at_rad : to;
  }
};

class PathCases {
 public:
  explicit PathCases(std::uint64_t seed) : random_(seed) {}

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  double spread(double low, double high) {  // evenly in the logarithm
    return std::exp(uniform(std::log(low), std::log(high)));
  }
  bool chance(double share) { return uniform(0.0, 1.0) < share; }

  /// One to twelve axes, zero to twelve way-points. Legs of 1e-6 to 3 rad, repeated points,
  /// reversals, single axes, collinear points, limits that differ by decades.
  PathCase odd() {
    PathCase one;
    const std::size_t axes = chance(0.7) ? 6 : static_cast<std::size_t>(uniform(1.0, 12.999));
    const bool alike = chance(0.5);
    AxisLimit limit{-99, 99, spread(0.01, 10), spread(0.1, 100), spread(1, 1e4)};
    for (std::size_t i = 0; i < axes; ++i) {
      if (!alike) limit = {-99, 99, spread(0.01, 10), spread(0.1, 100), spread(1, 1e4)};
      one.limits.push_back(limit);
      one.from.push_back(uniform(-3.0, 3.0));
    }
    const auto points = static_cast<int>(uniform(0.0, kMaxVias + 0.999));
    AxisAngles before = one.from, at = one.from;
    for (int i = 0; i <= points; ++i) {
      const AxisAngles next = odd_step(before, at);
      before = at;
      at = next;
      if (i < points) one.vias.push_back({at, odd_share(), odd_share()});
    }
    one.to = at;
    return one;
  }

  /// As in plans: six axes of an arm, legs of a tenth to some radians.
  PathCase usual(int points) {
    PathCase one;
    constexpr double kDeg = 3.14159265358979 / 180.0;
    for (const double speed_deg_s : {154.0, 154.0, 228.0, 343.0, 384.0, 721.0}) {
      one.limits.push_back({-99, 99, 0.8 * speed_deg_s * kDeg, 300 * kDeg, 3000 * kDeg});
      one.from.push_back(uniform(-1.0, 1.0));
    }
    one.to = one.from;
    // Each leg continues roughly in the direction of the preceding one.
    std::vector<double> onward(6, 0.0);
    for (int i = 0; i <= points; ++i) {
      const double size = spread(0.1, 1.0);
      for (std::size_t k = 0; k < 6; ++k) {
        onward[k] = 0.7 * onward[k] + uniform(-1.0, 1.0);
        one.to[k] += size * onward[k];
      }
      if (i < points) one.vias.push_back({one.to, 0.5, 0.5});
    }
    return one;
  }

 private:
  double odd_share() {
    if (chance(0.5)) return 0.5;
    if (chance(0.1)) return 0.0;
    return chance(0.2) ? spread(1e-6, 0.5) : uniform(0.0, 0.5);
  }

  AxisAngles odd_step(const AxisAngles& before, const AxisAngles& at) {
    AxisAngles next = at;
    if (chance(0.05)) return next;  // repeated point
    const double size = chance(0.2) ? spread(1e-6, 1.0) : spread(0.01, 1.0);
    if (chance(0.05)) return before;  // exact reversal
    if (chance(0.15)) {               // collinear, or almost
      const double off = chance(0.5) ? 0.0 : spread(1e-12, 1e-2);
      const double on = chance(0.3) ? -size : size;
      for (std::size_t k = 0; k < at.size(); ++k) {
        next[k] += on * (at[k] - before[k]) + off * uniform(-1.0, 1.0);
      }
      return next;
    }
    if (chance(0.15)) {
      const auto axis = static_cast<std::size_t>(uniform(0.0, static_cast<double>(at.size())));
      next[std::min(axis, at.size() - 1)] += size * uniform(-3.0, 3.0);
      return next;
    }
    for (double& angle : next) angle += size * uniform(-3.0, 3.0);
    return next;
  }

  std::mt19937_64 random_;
};

/// Largest share of the axes' limits.
struct Peaks {
  double speed = 0.0, acceleration = 0.0, jerk = 0.0;
  double worst() const { return std::max({speed, acceleration, jerk}); }
  void take(const Peaks& other) {
    speed = std::max(speed, other.speed);
    acceleration = std::max(acceleration, other.acceleration);
    jerk = std::max(jerk, other.jerk);
  }
};

/// By the chain rule, at one instant, with the arm at s.
inline Peaks peaks_at(const PathMove& move, const std::vector<AxisLimit>& limits, double t_s,
                      double at_s) {
  Peaks most;
  const ScalarState s = move.profile().at(t_s);
  const double jerk = move.profile().jerk_at(t_s);
  const PathShape& shape = move.shape();
  const AxisAngles first = shape.derivative(1, at_s), second = shape.derivative(2, at_s),
                   third = shape.derivative(3, at_s);
  const double v = s.speed, a = s.acceleration;
  const auto [i, in_corner] = shape.place(at_s);
  const auto way_rad = [&](std::size_t leg, std::size_t k) {
    return std::abs(shape.leg(leg).along_rad[k]) * shape.leg(leg).length;
  };
  for (std::size_t k = 0; k < limits.size(); ++k) {
    const AxisLimit& limit = limits[k];
    // An axis without detectable motion has no limits.
    if (way_rad(i, k) < kNoTravelRad && !(in_corner && way_rad(i + 1, k) >= kNoTravelRad)) continue;
    most.take({std::abs(first[k] * v) / limit.max_speed_rad_s,
               std::abs(second[k] * v * v + first[k] * a) / limit.max_acceleration_rad_s2,
               std::abs(third[k] * v * v * v + 3 * second[k] * v * a + first[k] * jerk) /
                   limit.max_jerk_rad_s3});
  }
  return most;
}

/// If s is within rounding of the end of a leg or corner it belongs to the preceding one.
inline Peaks peaks_at(const PathMove& move, const std::vector<AxisLimit>& limits, double t_s) {
  if (move.shape().legs() == 0) return {};
  const double s = move.profile().at(t_s).position, before = s - 1e-13 * (1.0 + std::abs(s));
  const Peaks here = peaks_at(move, limits, t_s, s), there = peaks_at(move, limits, t_s, before);
  return here.worst() <= there.worst() ? here : there;
}

inline Peaks peaks(const PathMove& move, const std::vector<AxisLimit>& limits, int samples) {
  Peaks most;
  for (int i = 0; i <= samples; ++i) {
    most.take(peaks_at(move, limits, move.duration_s() * i / samples));
  }
  return most;
}

/// Difference quotients of the positions only: never above the true peak derivative.
inline Peaks differences(const PathCase& path, int samples) {
  const PathMove move = path.move();
  const std::vector<AxisLimit>& limits = path.limits;
  Peaks most;
  if (move.duration_s() <= 0.0) return most;
  // A third difference has four times the rounding of one position, or of a leg without detectable
  // motion of any axis.
  const bool all_legs = move.shape().legs() == path.vias.size() + 1;
  const double noise = all_legs ? 1e-13 : 4 * kNoTravelRad;
  const double h = move.duration_s() / samples;
  for (int i = -3; i <= samples; ++i) {
    const AxisAngles p0 = move.at(i * h), p1 = move.at((i + 1) * h), p2 = move.at((i + 2) * h),
                     p3 = move.at((i + 3) * h);
    for (std::size_t k = 0; k < limits.size(); ++k) {
      const AxisLimit& limit = limits[k];
      const auto share = [&](double difference, double of) {
        return std::max(0.0, std::abs(difference) - noise) / of;
      };
      most.take({share(p1[k] - p0[k], limit.max_speed_rad_s * h),
                 share(p2[k] - 2 * p1[k] + p0[k], limit.max_acceleration_rad_s2 * h * h),
                 share(p3[k] - 3 * p2[k] + 3 * p1[k] - p0[k], limit.max_jerk_rad_s3 * h * h * h)});
    }
  }
  return most;
}

/// Distance of `q` from the legs and the triangles of the shares [rad]; 0 inside one of them.
inline double astray_rad(const PathCase& path, const AxisAngles& q) {
  const std::size_t axes = q.size();
  const auto minus = [&](const AxisAngles& a, const AxisAngles& b) {
    AxisAngles d = a;
    for (std::size_t k = 0; k < axes; ++k) d[k] -= b[k];
    return d;
  };
  const auto dot = [&](const AxisAngles& a, const AxisAngles& b) {
    double sum = 0.0;
    for (std::size_t k = 0; k < axes; ++k) sum += a[k] * b[k];
    return sum;
  };
  const auto from_segment = [&](const AxisAngles& a, const AxisAngles& b) {
    const AxisAngles along = minus(b, a), to = minus(q, a);
    const double square = dot(along, along);
    const double u = square > 0.0 ? std::clamp(dot(along, to) / square, 0.0, 1.0) : 0.0;
    AxisAngles off = to;
    for (std::size_t k = 0; k < axes; ++k) off[k] -= u * along[k];
    return std::sqrt(dot(off, off));
  };
  double least = HUGE_VAL;
  for (std::size_t i = 0; i <= path.vias.size(); ++i) {
    least = std::min(least, from_segment(path.point(i), path.point(i + 1)));
    if (i == path.vias.size()) break;
    // q - way-point = a * (back along the first leg) + b * (on along the second), a, b >= 0, a + b <= 1.
    const Via& via = path.vias[i];
    AxisAngles back = minus(path.point(i), via.at_rad), on = minus(path.point(i + 2), via.at_rad);
    for (std::size_t k = 0; k < axes; ++k) {
      back[k] *= via.in_share;
      on[k] *= via.out_share;
    }
    const AxisAngles to = minus(q, via.at_rad);
    const double bb = dot(back, back), oo = dot(on, on), bo = dot(back, on);
    const double determinant = bb * oo - bo * bo;
    if (determinant <= 1e-12 * bb * oo) continue;  // collinear: covered by the segments
    const double a = (dot(back, to) * oo - dot(on, to) * bo) / determinant;
    const double b = (dot(on, to) * bb - dot(back, to) * bo) / determinant;
    constexpr double kEdge = 1e-6;
    if (a < -kEdge || b < -kEdge || a + b > 1 + kEdge) continue;
    AxisAngles off = to;
    for (std::size_t k = 0; k < axes; ++k) off[k] -= a * back[k] + b * on[k];
    least = std::min(least, std::sqrt(dot(off, off)));
  }
  return least;
}

}  // namespace cellcal::drivers
