#include "calib/plan/track.h"

#include <algorithm>
#include <cmath>

namespace cellcal::calib {

namespace {

/// Upper bound of the distance from the arm's foot to the TCP.
double stretched_m(const ArmModel& arm) {
  double sum = arm.robot().flange_fixed.translation().norm() + arm.tool().tcp.translation().norm();
  for (const Joint& joint : arm.robot().joints) sum += std::hypot(joint.d_m, joint.a_m);
  return sum;
}

}  // namespace

double track_position_m(const ArmModel& arm, const Eigen::Vector3d& place_m, double margin_m,
                        Random& random) {
  const Robot& robot = arm.robot();
  if (robot.first_turning() == 0) return 0.0;
  const Joint& track = robot.joints[0];
  const double least = track.min_rad + margin_m, most = std::max(least, track.max_rad - margin_m);
  const Eigen::Vector3d along = robot.base_fixed.linear() * track.guide->along;
  const Eigen::Vector3d off = place_m - robot.base_fixed.translation();
  const double opposite = along.dot(off), beside = (off - opposite * along).norm();
  const double stretched = stretched_m(arm);
  const double half = beside < stretched ? std::sqrt(stretched * stretched - beside * beside) : 0.0;
  const double low = std::clamp(opposite - half, least, most),
               high = std::clamp(opposite + half, least, most);
  return random.uniform(low, high);
}

}  // namespace cellcal::calib
