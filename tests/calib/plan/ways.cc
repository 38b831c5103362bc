#include "tests/calib/plan/ways.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cellcal::calib::testing {

ArmModel nominal_arm(const Cell& cell) { return {cell.robot, cell.tool}; }

double gap_m(const Cell& cell, const ArmModel& arm, const JointVector& q) {
  const Eigen::Vector3d tip = arm.position(arm.prepare(q), nullptr);
  double gap = std::numeric_limits<double>::max();
  for (const Target& target : cell.targets)
    if (target.kind == TargetKind::kSphere)
      gap = std::min(gap, (tip - target.centre_m).norm() - target.diameter_m / 2.0);
  return gap;
}

JointVector between(const JointVector& a, const JointVector& b, double share) {
  JointVector q(a.size());
  for (std::size_t i = 0; i < q.size(); ++i) q[i] = a[i] + share * (b[i] - a[i]);
  return q;
}

void along(const ArmModel& arm, const JointVector& from, const JointVector& to,
           const std::function<void(const JointVector&)>& visit) {
  // Bound of the tip's path: every joint at its lever, which the whole arm bounds.
  double reach = arm.tool().tcp.translation().norm(), path = 0.0;
  for (const Joint& joint : arm.robot().joints) reach += std::hypot(joint.d_m, joint.a_m);
  for (std::size_t i = 0; i < from.size(); ++i) path += reach * std::abs(to[i] - from[i]);
  constexpr double kFineM = 0.5e-3;
  const int steps = std::max(1, static_cast<int>(std::ceil(path / kFineM)));
  for (int k = 0; k <= steps; ++k) visit(between(from, to, static_cast<double>(k) / steps));
}

double smallest_gap_m(const Cell& cell, const ArmModel& arm, const JointVector& from,
                      const std::vector<JointVector>& waypoints) {
  double smallest = std::numeric_limits<double>::max();
  const JointVector* last = &from;
  for (const JointVector& next : waypoints) {
    along(arm, *last, next,
          [&](const JointVector& q) { smallest = std::min(smallest, gap_m(cell, arm, q)); });
    last = &next;
  }
  return smallest;
}

}  // namespace cellcal::calib::testing
