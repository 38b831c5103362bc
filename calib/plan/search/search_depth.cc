#include "calib/plan/search/search_depth.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cellcal::calib {

namespace {

constexpr double kShaftMarginM = 0.005;
constexpr double kTipFromStandsM =
    0.004;  ///< from stands: what is met there would count as the sphere
/// A tip that only grazes may slide off.
constexpr double kGrazing = 0.9;
/// Where the nominal tip passes the middle by so much less than it needs, it meets the sphere with
/// an arm that is off, too: only such a sphere keeps the shaft from what is behind it.
constexpr double kSurelyM = 0.005;

constexpr double kNever = -std::numeric_limits<double>::max();

/// Where a point that comes along the line from far outside is first within `radius_m` of the stand
/// of a sphere: along the normal, from where it passes `off` beside that sphere's centre.
double at_stand(const Eigen::Vector3d& off, const Eigen::Vector3d& normal,
                const Eigen::Vector3d& up, double radius_m) {
  // off + t normal, seen from above: |h + t n| = radius.
  const Eigen::Vector3d h = off - off.dot(up) * up, n = normal - normal.dot(up) * up;
  const double a = n.squaredNorm(), b = h.dot(n), c = h.squaredNorm() - radius_m * radius_m;
  constexpr double kUpright = 1e-9;
  double first = std::numeric_limits<double>::max(), last = kNever;
  if (a > kUpright) {
    if (b * b <= a * c) return kNever;
    const double root = std::sqrt(b * b - a * c);
    first = (-b + root) / a;
    last = (-b - root) / a;
  } else if (c > 0.0) {
    return kNever;
  }
  // And no higher than the centre.
  const double height = off.dot(up), climb = normal.dot(up);
  if (climb > kUpright) first = std::min(first, -height / climb);
  if (height + first * climb > kUpright) return kNever;
  return first > last ? first : kNever;
}

}  // namespace

SearchDepth search_depth(const SearchLine& line, const std::vector<Eigen::Vector3d>& places,
                         double radius_m, const SearchStand& stand, const Tool& tool) {
  const double tip_radius = radius_m + tool.tip_radius_m;
  const double shaft_radius = radius_m + tool.radius_m + kShaftMarginM;
  // The shaft's end moves along the same direction, behind the tip and, where the tool is tilted,
  // beside it.
  const Eigen::Vector3d behind = -tool.slim_length_m * line.shaft;
  const double above = behind.dot(line.normal);
  const Eigen::Vector3d beside = behind - above * line.normal;
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
    const double sure = tip + kSurelyM;
    const double surely_at =
        sure < tip_radius ? height + std::sqrt(tip_radius * tip_radius - sure * sure) : kNever;
    const double shaft_at =
        shaft < shaft_radius
            ? height + std::sqrt(shaft_radius * shaft_radius - shaft * shaft) - above
            : kNever;
    if (shaft_at > surely_at) depth.end_m = std::max(depth.end_m, shaft_at);
    if (stand.radius_m > 0.0) {
      const double tip_stands = at_stand(
          -off, line.normal, stand.up,
          stand.radius_m + std::max(tool.slim_radius_m, tool.tip_radius_m) + kTipFromStandsM);
      const double shaft_stands = at_stand(behind - off, line.normal, stand.up,
                                           stand.radius_m + tool.radius_m + kShaftMarginM);
      const double stands = std::max(tip_stands, shaft_stands);
      if (stands > surely_at) depth.end_m = std::max(depth.end_m, stands);
    }
    met.push_back(tip_at);
  }
  depth.end_m = std::max(depth.end_m, lowest);
  for (const double at : met) depth.share += at > depth.end_m;
  if (!places.empty()) depth.share /= static_cast<double>(places.size());
  return depth;
}

}  // namespace cellcal::calib
