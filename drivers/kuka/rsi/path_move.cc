#include "drivers/kuka/rsi/path_move.h"

#include <algorithm>
#include <cmath>

namespace cellcal::drivers {

PathMove::PathMove(const AxisAngles& from_rad, const AxisAngles& to_rad,
                   std::span<const AxisLimit> limits, double cruise_s, const Vias& vias)
    : from_rad_(from_rad), to_rad_(to_rad), shape_(from_rad, vias, to_rad, limits) {
  if (cruise_s > 0.0 && shape_.legs() == 1) {
    double& speed = shape_.leg(0).limits.speed;
    speed = std::min(speed, 1.0 / cruise_s);
  }
  choose_corners(shape_, limits);
  run(0.0, {});
  // The choice is based on estimates; ensures that passing is never slower than stopping.
  if (duration_s() <= duration_with_rests_s()) return;
  rest_in_corners(shape_);
  run(0.0, {});
}

double PathMove::duration_with_rests_s() const {
  double sum_s = 0.0;
  for (std::size_t i = 0; i < shape_.legs(); ++i) {
    sum_s += ScalarProfile::travel(shape_.leg(i).length, shape_.leg(i).limits).duration_s();
  }
  return sum_s;
}

/// From rest. Beyond where it starts corners are reached at their speeds or, if too near, at lower ones.
void PathMove::run(double from_s, PathShape::Place from) {
  profile_ = ScalarProfile({from_s, 0.0, 0.0});
  ends_s_.assign(2 * from.leg + (from.in_corner ? 1 : 0), 0.0);
  const auto travel_to = [&](double end, double speed, const ScalarLimits& limits) {
    const ScalarState& here = profile_.end();
    profile_.travel_to(end, reachable_speed(here.speed, end - here.position, speed, limits),
                       limits);
  };
  while (ends_s_.size() < 2 * shape_.legs()) {
    const std::size_t leg = ends_s_.size() / 2;
    const double speed = speed_behind(leg);
    if (ends_s_.size() % 2 == 0) {
      travel_to(shape_.straight_end(leg), speed, shape_.leg(leg).limits);
    } else if (speed > 0.0 && profile_.end().speed == speed) {
      profile_.cruise_to(shape_.straight_begin(leg + 1));
    } else if (speed > 0.0) {
      ScalarLimits limits = shape_.corner(leg).brakes.front().limits;
      limits.speed = speed;
      travel_to(shape_.straight_begin(leg + 1), speed, limits);
    }
    ends_s_.push_back(profile_.duration_s());
  }
}

double PathMove::speed_behind(std::size_t leg) const {
  return leg + 1 < shape_.legs() ? shape_.corner(leg).speed : 0.0;
}

AxisAngles PathMove::at(double t_s) const {
  if (!braked_ && t_s >= profile_.duration_s()) return to_rad_;
  return shape_.legs() > 0 ? shape_.at(profile_.at(t_s).position) : from_rad_;
}

double PathMove::fastest_axis_rad_s(double t_s) const {
  if (shape_.legs() == 0) return 0.0;
  const ScalarState state = profile_.at(t_s);
  return std::abs(state.speed) * shape_.fastest_rad(state.position);
}

/// Braking limits at this place, and the speed down to which they apply.
PathMove::Stage PathMove::stage_at(PathShape::Place place, double speed) const {
  if (!place.in_corner) return {0.0, shape_.leg(place.leg).limits};
  const auto& brakes = shape_.corner(place.leg).brakes;
  std::size_t i = 0;
  while (i + 1 < brakes.size() && brakes[i + 1].from_speed >= speed) ++i;
  return {i + 1 < brakes.size() ? brakes[i + 1].from_speed : 0.0, brakes[i].limits};
}

PathShape::Place PathMove::place_at(double t_s) const {
  std::size_t i = 0;
  while (i + 2 < ends_s_.size() && t_s >= ends_s_[i]) ++i;
  return {i / 2, i % 2 != 0};
}

ScalarProfile PathMove::stop_from(const ScalarState& state, PathShape::Place place,
                                  bool in_stages) const {
  ScalarProfile stop(state);
  for (;;) {
    const ScalarState here = stop.end();
    const Stage stage = stage_at(place, here.speed);
    const ScalarLimits& limits = stage.limits;
    const auto slowed_to = [&](double speed) {
      ScalarProfile slowed(here);
      slowed.slow(speed, limits);
      return slowed.end().position;
    };
    const double end =
        place.in_corner ? shape_.straight_begin(place.leg + 1) : shape_.straight_end(place.leg);
    const double most = speed_behind(place.leg);
    const double wanted = in_stages ? stage.to_speed : 0.0;
    if (most == 0.0 || slowed_to(wanted) <= end) {
      stop.slow(wanted, limits);
      if (wanted == 0.0) return stop;
      continue;
    }
    // Speed after reducing the acceleration to zero immediately.
    const double a = here.acceleration, coasting = here.speed + a * std::abs(a) / (2 * limits.jerk);
    stop.slow(last_where(std::min(coasting, most), 0.0,
                         [&](double speed) { return slowed_to(speed) <= end; }),
              limits);
    stop.end_at(end);
    place = {place.leg + (place.in_corner ? 1 : 0), !place.in_corner};
  }
}

void PathMove::brake_at(double t_s) {
  if (shape_.legs() == 0) return;
  const ScalarState state = profile_.at(t_s);
  const PathShape::Place place = place_at(t_s);
  const ScalarProfile steady = stop_from(state, place, false),
                      staged = stop_from(state, place, true);
  profile_ = staged.duration_s() < steady.duration_s() ? staged : steady;
  braked_ = true;
}

void PathMove::brake_within(double t_s, double longest_s) {
  constexpr double kHarder = 1.2;
  if (shape_.legs() == 0) return;
  const ScalarState state = profile_.at(t_s);
  const PathShape::Place place = place_at(t_s);
  brake_at(t_s);
  const ScalarLimits here = stage_at(place, state.speed).limits;
  for (ScalarLimits limits = here; duration_s() > longest_s;) {
    limits.acceleration *= kHarder;
    limits.jerk *= kHarder;
    profile_ = ScalarProfile::brake(state, limits);
  }
}

namespace {

/// Integral of sigma (order -1), sigma, and its first and second derivative.
double sigma(int order, double u, double ramp) {
  const double level = 1.0 / (1.0 - ramp);
  if (u > 0.5) {
    const double mirrored = sigma(order, 1.0 - u, ramp);
    if (order == 0) return u - 0.5 + mirrored;
    if (order == 1) return 1.0 - mirrored;
    return order == 2 ? mirrored : -mirrored;
  }
  const double up = std::min(u, ramp), on = u - up;
  if (order == 3) return u < ramp ? level / ramp : 0.0;
  if (order == 2) return level * up / ramp;
  if (order == 1) return level * (up * up / (2.0 * ramp) + on);
  return level * (up * up * up / (6.0 * ramp) + on * (ramp / 2.0 + on / 2.0));
}

/// Duration of the leg at the axes' speed limits; 0: no motion.
double least_duration_s(const AxisAngles& from_rad, const AxisAngles& to_rad,
                        std::span<const AxisLimit> limits) {
  double longest_s = 0.0;
  for (std::size_t i = 0; i < from_rad.size(); ++i) {
    const double way = std::abs(to_rad[i] - from_rad[i]);
    if (way >= kNoTravelRad) longest_s = std::max(longest_s, way / limits[i].max_speed_rad_s);
  }
  return longest_s;
}

PathLeg leg_between(const AxisAngles& from_rad, const AxisAngles& to_rad,
                    std::span<const AxisLimit> limits, double start, double length) {
  PathLeg leg{from_rad, to_rad, start, length, 0.0, {HUGE_VAL, HUGE_VAL, HUGE_VAL}};
  for (std::size_t i = 0; i < from_rad.size(); ++i) {
    const double way = to_rad[i] - from_rad[i];
    leg.along_rad[i] = way / length;
    const double share = std::abs(leg.along_rad[i]);
    leg.fastest_rad = std::max(leg.fastest_rad, share);
    if (std::abs(way) < kNoTravelRad) continue;
    leg.limits.speed = std::min(leg.limits.speed, limits[i].max_speed_rad_s / share);
    leg.limits.acceleration =
        std::min(leg.limits.acceleration, limits[i].max_acceleration_rad_s2 / share);
    leg.limits.jerk = std::min(leg.limits.jerk, limits[i].max_jerk_rad_s3 / share);
  }
  return leg;
}

// Shares reserved for braking in a corner: larger ones make corners slower, smaller ones stops
// longer.
constexpr double kBrake = 0.15, kBrakeJerk = 0.25;
// A corner passed more slowly than possible leaves more for a brake. Share of the jerk reserved for
// the brake's own changes.
constexpr double kJerkLeft = 0.3;
// Half lengths tried, as shares of the longest; 0 is a rest. A wide corner is passed faster but at
// one speed, a narrow one leaves more of the legs for acceleration.
constexpr std::array kTried = {1.0, 0.7, 0.45, 0.25, 0.12, 0.04, 0.0};
constexpr int kSweeps = 2;
// Ramps tried: short ones need less acceleration, long ones less jerk.
constexpr std::array kRamps = {0.12, 0.2, 0.33, 0.5};
// Speeds from which a brake may be harder, as shares of the corner's.
constexpr std::array<double, kBrakeStages> kStages = {1.0, 0.85, 0.65, 0.4};
// Narrower corners are rests.
constexpr double kNarrowestRad = 1e-9;
// Rounding tolerance.
constexpr double kRounding = 1e-9;

double level(double ramp) { return 1.0 / (1.0 - ramp); }

/// Speed of a corner of half length e: at most `speed`, and v^2 / e and v^3 / e^2 at most these.
struct Bend {
  double ramp = 0.5, speed = 0.0, acceleration = HUGE_VAL, jerk = HUGE_VAL;

  double speed_at(double e) const {
    const double most = std::min({speed, std::sqrt(acceleration * e), std::cbrt(jerk * e * e)});
    return most * (1.0 - kRounding);
  }
};

/// Approximate highest speed on a leg, from above: Newton's steps from its value without jerk
/// limits.
double about_peak(double from, double to, double distance, const ScalarLimits& limits) {
  constexpr int kSteps = 3;
  const double least = std::max(from, to);
  double peak = std::sqrt((from * from + to * to) / 2.0 + limits.acceleration * distance);
  peak = std::clamp(peak, least, std::max(least, limits.speed));
  for (int i = 0; i < kSteps; ++i) {
    const double beyond = ramp_distance(from, peak, limits) + ramp_distance(peak, to, limits);
    if (beyond <= distance) break;
    const double slope =
        (ramp_duration_s(from, peak, limits) + ramp_duration_s(peak, to, limits)) / 2.0 +
        (from + to + 2.0 * peak) / 2.0 / limits.acceleration;
    peak = std::max(least, peak - (beyond - distance) / slope);
  }
  return peak;
}

/// Approximate duration of a leg.
double about_s(double from, double to, double distance, const ScalarLimits& limits) {
  const double peak = about_peak(from, to, distance, limits);
  const double ramps_s = ramp_duration_s(from, peak, limits) + ramp_duration_s(peak, to, limits);
  const double ramps = ramp_distance(from, peak, limits) + ramp_distance(peak, to, limits);
  return ramps_s + (peak > 0.0 ? (distance - ramps) / peak : 0.0);
}

class Chooser {
 public:
  Chooser(PathShape& path, std::span<const AxisLimit> limits) : path_(path), limits_(limits) {
    for (std::size_t i = 0; i < corners(); ++i) {
      for (std::size_t r = 0; r < kRamps.size(); ++r) bends_[i][r] = bend_of(i, kRamps[r]);
      PathCorner& corner = path.corner(i);
      const double fastest = std::max(path.leg(i).fastest_rad, path.leg(i + 1).fastest_rad);
      if (corner.longest * fastest < kNarrowestRad) corner.longest = 0.0;
      set(i, corner.longest);
    }
  }

  void choose() {
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      for (std::size_t i = 0; i < corners(); ++i) choose(i);
    }
    make_reachable();
    for (std::size_t i = 0; i < corners(); ++i) {
      for (std::size_t stage = 0; stage < kBrakeStages; ++stage) {
        const double v = kStages[stage] * speed(i);
        path_.corner(i).brakes[stage] = {v, brake_of(i, v)};
      }
    }
  }

 private:
  std::size_t corners() const { return path_.legs() > 0 ? path_.legs() - 1 : 0; }
  double speed(std::size_t corner) const { return path_.corner(corner).speed; }
  double speed_before(std::size_t i) const { return i > 0 ? speed(i - 1) : 0.0; }
  double speed_behind(std::size_t i) const { return i + 1 < corners() ? speed(i + 1) : 0.0; }
  double straight(std::size_t leg) const {
    return std::max(0.0, path_.straight_end(leg) - path_.straight_begin(leg));
  }

  /// Calls `use(change, most, limit)` for each axis with detectable motion on one of the legs: |d'
  /// - d|, and the larger of |d| and |d'|.
  template <typename Use>
  void each_axis(std::size_t corner, Use use) const {
    const PathLeg &in = path_.leg(corner), &out = path_.leg(corner + 1);
    for (std::size_t k = 0; k < limits_.size(); ++k) {
      const double before = std::abs(in.along_rad[k]), behind = std::abs(out.along_rad[k]);
      if (before * in.length < kNoTravelRad && behind * out.length < kNoTravelRad) continue;
      use(std::abs(out.along_rad[k] - in.along_rad[k]), std::max(before, behind), limits_[k]);
    }
  }

  Bend bend_of(std::size_t corner, double ramp) const {
    const double speed =
        std::min(path_.leg(corner).limits.speed, path_.leg(corner + 1).limits.speed);
    Bend bend{ramp, speed, HUGE_VAL, HUGE_VAL};
    const double by_acceleration = level(ramp) / 2.0;
    const double by_jerk = level(ramp) * (0.25 / ramp + 1.5 * kBrake);
    each_axis(corner, [&](double change, double most, const AxisLimit& limit) {
      if (change == 0.0) return;
      bend.acceleration =
          std::min(bend.acceleration,
                   limit.max_acceleration_rad_s2 / (by_acceleration * change + kBrake * most));
      bend.jerk =
          std::min(bend.jerk, limit.max_jerk_rad_s3 / (by_jerk * change + kBrakeJerk * most));
    });
    return bend;
  }

  ScalarLimits brake_of(std::size_t corner, double v) const {
    const double e = path_.corner(corner).half;
    if (v <= 0.0) return {};
    const double ramp = path_.corner(corner).ramp, h = level(ramp);
    const double jerk_of_bend = h * v * v * v / (4.0 * ramp * e * e);
    const double jerk_of_brake = 1.5 * h * v / e;  // per unit of A
    // Remainder of the axes' accelerations after the bend, and a value that leaves enough of their
    // jerk.
    double acceleration = HUGE_VAL, quiet = HUGE_VAL, jerk = HUGE_VAL;
    each_axis(corner, [&](double change, double most, const AxisLimit& limit) {
      const double left = limit.max_acceleration_rad_s2 - change * h * v * v / (2.0 * e);
      acceleration = std::min(acceleration, left / most);
      if (change == 0.0) return;
      const double bent = (1.0 - kJerkLeft) * limit.max_jerk_rad_s3 / change - jerk_of_bend;
      quiet = std::min(quiet, bent / jerk_of_brake);
    });
    acceleration = std::min(acceleration, std::max(quiet, kBrake * v * v / e));
    each_axis(corner, [&](double change, double most, const AxisLimit& limit) {
      const double bent = change * (jerk_of_bend + jerk_of_brake * acceleration);
      jerk = std::min(jerk, (limit.max_jerk_rad_s3 - bent) / most);
    });
    return {HUGE_VAL, acceleration, jerk};
  }

  void set(std::size_t i, double half) {
    PathCorner& corner = path_.corner(i);
    corner.half = half;
    corner.speed = 0.0;
    if (half <= 0.0) return;
    for (const Bend& bend : bends_[i]) {
      const double v = bend.speed_at(half);
      if (v <= corner.speed) continue;
      corner.speed = v;
      corner.ramp = bend.ramp;
    }
  }

  /// From the preceding corner to the next one.
  double about_s_around(std::size_t i) const {
    const double before = straight(i), behind = straight(i + 1);
    const double from = speed_before(i), to = speed_behind(i);
    const PathLeg &in = path_.leg(i), &out = path_.leg(i + 1);
    const double reached = from * from + 2.0 * in.limits.acceleration * before;
    const double left = to * to + 2.0 * out.limits.acceleration * behind;
    const double v = std::min(speed(i), std::sqrt(std::min(reached, left)));
    const double corner_s = v > 0.0 ? 2.0 * path_.corner(i).half / v : 0.0;
    return about_s(from, v, before, in.limits) + corner_s + about_s(v, to, behind, out.limits);
  }

  void choose(std::size_t i) {
    const double longest = path_.corner(i).longest;
    if (longest == 0.0) return;
    double best_s = HUGE_VAL, best = longest;
    for (const double share : kTried) {
      set(i, share * longest);
      const double s = about_s_around(i);
      if (s >= best_s) continue;
      best_s = s;
      best = share * longest;
    }
    set(i, best);
  }

  void make_reachable() {
    const auto limit = [&](std::size_t i, double from, std::size_t leg) {
      double& v = path_.corner(i).speed;
      v = reachable_speed(from, straight(leg), v, path_.leg(leg).limits);
    };
    for (std::size_t i = corners(); i-- > 0;) limit(i, speed_behind(i), i + 1);
    for (std::size_t i = 0; i < corners(); ++i) limit(i, speed_before(i), i);
  }

  PathShape& path_;
  std::span<const AxisLimit> limits_;
  std::array<std::array<Bend, kRamps.size()>, kMaxVias> bends_;  // one per ramp
};

}  // namespace

PathShape::PathShape(const AxisAngles& from_rad, const Vias& vias, const AxisAngles& to_rad,
                     std::span<const AxisLimit> limits) {
  AxisAngles from = from_rad;
  double first_s = 0.0, start = 0.0;
  double left_behind = 0.0;  // share of the next leg available to the corner before it
  for (std::size_t i = 0; i <= vias.size(); ++i) {
    const AxisAngles& to = i < vias.size() ? vias[i].at_rad : to_rad;
    const double least_s = least_duration_s(from, to, limits);
    if (least_s == 0.0) {
      left_behind = 0.0;
      if (!corners_.empty() && corners_.size() == legs_.size()) corners_.back().longest = 0.0;
      continue;
    }
    if (first_s == 0.0) first_s = least_s;
    first_leg_moves_ = first_leg_moves_ || i == 0;
    const double length = least_s / first_s;
    if (!legs_.empty()) {
      PathCorner& before = corners_.back();
      before.longest = std::min(before.longest, left_behind * length);
    }
    legs_.push_back(leg_between(from, to, limits, start, length));
    start += length;
    from = to;
    if (i == vias.size()) break;
    left_behind = vias[i].out_share;
    corners_.push_back({vias[i].in_share * length, 0.0, 0.5, 0.0, {}});
  }
  // The last leg has no corner.
  if (!legs_.empty()) corners_.resize(legs_.size() - 1);
}

double PathShape::straight_begin(std::size_t leg) const {
  return legs_[leg].start + (leg > 0 ? corners_[leg - 1].half : 0.0);
}

double PathShape::straight_end(std::size_t leg) const {
  const double end = legs_[leg].start + legs_[leg].length;
  return end - (leg < corners_.size() ? corners_[leg].half : 0.0);
}

PathShape::Place PathShape::place(double s) const {
  std::size_t leg = 0;
  while (leg < corners_.size() && s >= straight_begin(leg + 1)) ++leg;
  return {leg, leg < corners_.size() && s > straight_end(leg)};
}

double PathShape::corner_share(std::size_t corner, double s) const {
  return (s - straight_end(corner)) / (2.0 * corners_[corner].half);
}

/// Share of d' - d in the path, or in its derivatives by s.
double PathShape::bent(int order, std::size_t corner, double s) const {
  const double width = 2.0 * corners_[corner].half;
  const double per_s[] = {width, 1.0, 1.0 / width, 1.0 / (width * width)};
  return per_s[order] * sigma(order, corner_share(corner, s), corners_[corner].ramp);
}

AxisAngles PathShape::at(double s) const {
  const auto [i, in_corner] = place(s);
  const PathLeg& leg = legs_[i];
  AxisAngles angles = leg.from_rad;
  for (std::size_t k = 0; k < angles.size(); ++k) {
    angles[k] += (s - leg.start) * leg.along_rad[k];
  }
  if (!in_corner) return angles;
  const double share = bent(0, i, s);
  for (std::size_t k = 0; k < angles.size(); ++k) {
    angles[k] += share * (legs_[i + 1].along_rad[k] - leg.along_rad[k]);
  }
  return angles;
}

AxisAngles PathShape::derivative(int order, double s) const {
  const auto [i, in_corner] = place(s);
  AxisAngles result = legs_[i].along_rad;
  const double share = in_corner ? bent(order, i, s) : 0.0;
  for (std::size_t k = 0; k < result.size(); ++k) {
    const double onward = in_corner ? legs_[i + 1].along_rad[k] - result[k] : 0.0;
    result[k] = (order == 1 ? result[k] : 0.0) + share * onward;
  }
  return result;
}

double PathShape::fastest_rad(double s) const {
  if (const Place here = place(s); !here.in_corner) return legs_[here.leg].fastest_rad;
  double most = 0.0;
  for (const double along : derivative(1, s)) most = std::max(most, std::abs(along));
  return most;
}

void choose_corners(PathShape& path, std::span<const AxisLimit> limits) {
  Chooser(path, limits).choose();
}

void rest_in_corners(PathShape& path) {
  for (std::size_t i = 0; i + 1 < path.legs(); ++i) {
    path.corner(i).half = path.corner(i).speed = 0.0;
  }
}

}  // namespace cellcal::drivers
