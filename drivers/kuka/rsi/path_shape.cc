#include "drivers/kuka/rsi/path_shape.h"

#include <algorithm>
#include <cmath>

namespace cellcal::drivers {
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

}  // namespace cellcal::drivers
