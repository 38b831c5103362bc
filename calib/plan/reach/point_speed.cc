#include "calib/plan/reach/point_speed.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

/// Chords of a turn by so much are 0.01 % shorter than the arc.
constexpr double kChordRad = 2.0 * kRadPerDeg;

std::vector<Eigen::Vector3d> points_m(const ArmModel& arm, std::span<const double> q) {
  std::vector<Eigen::Vector3d> points = arm.shape(arm.prepare(q), nullptr).joint_origin_m;
  for (int tool = 0; tool < arm.tool_count(); ++tool) points.push_back(arm.nominal_tip_m(q, tool));
  return points;
}

}  // namespace

double fastest_point_m_s(const ArmModel& arm, std::span<const double> from,
                         std::span<const double> to) {
  double farthest_rad = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i)
    farthest_rad = std::max(farthest_rad, std::abs(to[i] - from[i]));
  const int steps = std::max(1, static_cast<int>(std::ceil(farthest_rad / kChordRad)));
  std::vector<double> q(from.begin(), from.end());
  std::vector<Eigen::Vector3d> before = points_m(arm, q);
  double fastest_m_s = 0.0;
  for (int k = 1; k <= steps; ++k) {
    const double s = static_cast<double>(k) / steps;
    for (std::size_t i = 0; i < q.size(); ++i) q[i] = from[i] + s * (to[i] - from[i]);
    std::vector<Eigen::Vector3d> now = points_m(arm, q);
    for (std::size_t p = 0; p < now.size(); ++p)
      fastest_m_s = std::max(fastest_m_s, steps * (now[p] - before[p]).norm());
    before = std::move(now);
  }
  return fastest_m_s;
}

}  // namespace cellcal::calib
