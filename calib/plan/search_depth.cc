#include "calib/plan/search_depth.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cellcal::calib {

namespace {

constexpr double kShaftMarginM = 0.005;
/// A tip that only grazes may slide off.
constexpr double kGrazing = 0.9;

}  // namespace

SearchDepth search_depth(const SearchLine& line, const std::vector<Eigen::Vector3d>& places,
                         double radius_m, const Tool& tool) {
  const double tip_radius = radius_m + tool.tip_radius_m;
  const double shaft_radius = radius_m + tool.radius_m + kShaftMarginM;
  // The shaft's end moves along the same direction, behind the tip and, where the tool is tilted,
  // beside it.
  const Eigen::Vector3d behind = -tool.slim_length_m * line.shaft;
  const double above = behind.dot(line.normal);
  const Eigen::Vector3d beside = behind - above * line.normal;
  constexpr double kNever = -std::numeric_limits<double>::max();
  SearchDepth depth;
  depth.end_m = kNever;
  double lowest = std::numeric_limits<double>::max();
  std::vector<double> met;
  met.reserve(places.size());
  for (const Eigen::Vector3d& place : places) {
    const Eigen::Vector3d off = place - line.aim_m;
    const double height = off.dot(line.normal);
    const Eigen::Vector3d across = off - height * line.normal;
    lowest = std::min(lowest, height);
    const double tip = across.norm(), shaft = (across - beside).norm();
    const double tip_at = tip < kGrazing * tip_radius
                              ? height + std::sqrt(tip_radius * tip_radius - tip * tip)
                              : kNever;
    const double shaft_at =
        shaft < shaft_radius
            ? height + std::sqrt(shaft_radius * shaft_radius - shaft * shaft) - above
            : kNever;
    if (shaft_at > tip_at) depth.end_m = std::max(depth.end_m, shaft_at);
    met.push_back(tip_at);
  }
  depth.end_m = std::max(depth.end_m, lowest);
  for (const double at : met) depth.share += at > depth.end_m;
  if (!places.empty()) depth.share /= static_cast<double>(places.size());
  return depth;
}

}  // namespace cellcal::calib
