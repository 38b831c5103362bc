#include "drivers/kuka/rsi/path_move.h"

#include <algorithm>
#include <cmath>

#include "drivers/kuka/rsi/halving.h"
#include "drivers/kuka/rsi/path_shape.h"

namespace cellcal::drivers {

PathMove::PathMove(const AxisAngles& from_rad, const AxisAngles& to_rad,
                   std::span<const AxisLimit> limits, double cruise_s, const Vias& vias)
    : from_rad_(from_rad), to_rad_(to_rad), shape_(from_rad, vias, to_rad, limits) {
  if (cruise_s > 0.0 && shape_.legs() == 1) {
    double& speed = shape_.leg(0).limits.speed;
    speed = std::min(speed, 1.0 / cruise_s);
  }
  choose_corners(shape_, limits);
  run();
  // The choice is based on estimates; ensures that passing is never slower than stopping.
  if (duration_s() <= duration_with_rests_s()) return;
  rest_in_corners(shape_);
  run();
}

double PathMove::duration_with_rests_s() const {
  double sum_s = 0.0;
  for (std::size_t i = 0; i < shape_.legs(); ++i) {
    sum_s += ScalarProfile::travel(shape_.leg(i).length, shape_.leg(i).limits).duration_s();
  }
  return sum_s;
}

void PathMove::run() {
  profile_ = ScalarProfile();
  ends_s_.clear();
  for (std::size_t i = 0; i < shape_.legs(); ++i) {
    profile_.travel_to(shape_.straight_end(i), speed_behind(i), shape_.leg(i).limits);
    ends_s_.push_back(profile_.duration_s());
    if (speed_behind(i) > 0.0) profile_.cruise_to(shape_.straight_begin(i + 1));
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

}  // namespace cellcal::drivers
