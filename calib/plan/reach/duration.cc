#include "calib/plan/reach/duration.h"

#include <algorithm>
#include <cmath>

#include "calib/model/error.h"

namespace cellcal::calib {

void require_speeds(const Robot& robot) {
  for (const Joint& joint : robot.joints)
    if (!(joint.max_speed_rad_s > 0.0))
      throw PlanError("robot file of " + robot.name + ": joint " + joint.name +
                      " has no max_speed_deg_s. Add it: no motion can be planned without");
}

double move_s(const Robot& robot, const JointVector& from, const JointVector& to,
              const Pace& pace) {
  double slowest = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const double way = std::abs(to[i] - from[i]);
    const double speed = pace.speed_fraction * robot.joints[i].max_speed_rad_s;
    // A slower cruise is reached as much sooner.
    const double ramp_s = pace.speed_fraction * pace.ramp_s;
    slowest = std::max(slowest, way > speed * ramp_s ? way / speed + ramp_s  // (65)
                                                     : 2.0 * std::sqrt(way * ramp_s / speed));
  }
  return slowest > 0.0 ? slowest + pace.build_up_s : 0.0;
}

double touch_s(double expected_m, const Pace& pace) {
  double sum = expected_m / pace.fast_m_s + pace.overhead_s;
  for (int k = 0; k < pace.readings; ++k) {
    const double back_m = k == 0 ? pace.back_off_m : pace.slow_back_off_m;
    sum += back_m / pace.slow_m_s + back_m / pace.fast_m_s + pace.overhead_s;
  }
  return sum;
}

double duration_s(const Plan& plan, const Robot& robot, const Pace& pace) {
  double sum = 0.0;
  const JointVector* at = &plan.start;
  for (const PlannedTouch& touch : plan.touches) {
    for (const JointVector& waypoint : touch.transit) {
      sum += move_s(robot, *at, waypoint, pace);
      at = &waypoint;
    }
    sum += touch_s(touch.expected_m, pace);
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
