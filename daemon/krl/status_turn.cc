#include "daemon/krl/status_turn.h"

#include <cmath>

#include "calib/model/units.h"

namespace cellcal::daemon::krl {

namespace {

using calib::kRadPerDeg;
using calib::kRadPerTurn;

constexpr double kZeroRad = 0.01 * kRadPerDeg;
constexpr std::size_t kArmAxes = 6;

/// `before`: joints before A1.
calib::Posture reference(const calib::Configurations& ways, std::size_t before) {
  calib::JointVector q(before, 0.0);
  for (const double deg : {0.0, -90.0, 90.0, 0.0, 90.0, 0.0}) q.push_back(deg * kRadPerDeg);
  return ways.posture_of(q);
}

/// The whole turn on that side of 0 within the limits.
std::optional<double> on_side(double angle, bool below, const calib::Joint& joint) {
  std::optional<double> by_rounding;
  for (const double one : {angle, angle - kRadPerTurn, angle + kRadPerTurn}) {
    if (one < joint.min_rad || one > joint.max_rad) continue;
    if ((one < 0.0) == below) return one;
    if (std::abs(one) < kZeroRad) by_rounding = one;
  }
  return by_rounding;
}

}  // namespace

StatusTurn status_turn_of(const calib::Configurations& ways, const calib::JointVector& q) {
  const std::size_t first = q.size() - kArmAxes;
  const calib::Posture home = reference(ways, first), at = ways.posture_of(q);
  StatusTurn result;
  result.status = (at.shoulder != home.shoulder ? 1 : 0) | (at.elbow == home.elbow ? 2 : 0) |
                  (at.wrist != home.wrist ? 4 : 0);
  for (std::size_t i = 0; i < kArmAxes; ++i)
    if (q[first + i] < 0.0) result.turn |= 1 << i;
  return result;
}

std::optional<calib::JointVector> joints_of(const calib::Configurations& ways,
                                            const calib::Robot& robot, const Eigen::Isometry3d& tcp,
                                            StatusTurn wanted, double unit_m) {
  const std::size_t first = robot.first_turning();
  const calib::Posture home = reference(ways, first);
  const calib::Posture posture{(wanted.status & 1) != 0 ? !home.shoulder : home.shoulder,
                               (wanted.status & 2) != 0 ? home.elbow : !home.elbow,
                               (wanted.status & 4) != 0 ? !home.wrist : home.wrist};
  auto q = ways.in_posture(tcp, posture, unit_m);
  if (!q) return std::nullopt;
  for (std::size_t i = first; i < q->size(); ++i) {
    const auto angle = on_side((*q)[i], (wanted.turn >> (i - first) & 1) != 0, robot.joints[i]);
    if (!angle) return std::nullopt;
    (*q)[i] = *angle;
  }
  return q;
}

}  // namespace cellcal::daemon::krl
