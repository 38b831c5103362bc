#include "calib/plan/duration.h"

#include <algorithm>
#include <cmath>

namespace cellcal::calib {

double move_s(const Robot& robot, const JointVector& from, const JointVector& to,
              const Pace& pace) {
  double slowest = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const double way = std::abs(to[i] - from[i]);
    const double speed = pace.speed_fraction * robot.joints[i].max_speed_rad_s;
    const double a = pace.acceleration_rad_s2;
    const bool cruises = way * a > speed * speed;
    slowest = std::max(slowest, cruises ? way / speed + speed / a : 2.0 * std::sqrt(way / a));
  }
  // Every ramp takes as much longer as the acceleration takes to build up.
  return slowest > 0.0 ? slowest + pace.acceleration_rad_s2 / pace.jerk_rad_s3 : 0.0;
}

double duration_s(const Plan& plan, const Robot& robot, const Pace& pace) {
  double sum = 0.0;
  const JointVector* at = &plan.start;
  for (const PlannedTouch& touch : plan.touches) {
    for (const JointVector& waypoint : touch.transit) {
      sum += move_s(robot, *at, waypoint, pace);
      at = &waypoint;
    }
    sum += touch.expected_m / pace.fast_m_s + pace.overhead_s;
    sum += pace.readings *
           (pace.back_off_m / pace.slow_m_s + pace.back_off_m / pace.fast_m_s + pace.overhead_s);
    sum += move_s(robot, touch.standoff, touch.clear, pace);
    at = &touch.clear;
  }
  for (const JointVector& waypoint : plan.home) {
    sum += move_s(robot, *at, waypoint, pace);
    at = &waypoint;
  }
  return sum;
}

}  // namespace cellcal::calib
