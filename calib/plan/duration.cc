#include "calib/plan/duration.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "calib/model/error.h"
#include "calib/model/units.h"

namespace cellcal::calib {

void require_speeds(const Robot& robot) {
  for (const Joint& joint : robot.joints)
    if (!(joint.max_speed_rad_s > 0.0)) {
      PlanError error(
          PlanError::Kind::kCell,
          "robot file of " + robot.name + ": joint " + joint.name +
              (joint.is_prismatic() ? " has no max_speed_mm_s" : " has no max_speed_deg_s") +
              ". Add it: no motion can be planned without");
      error.joint = joint.name;
      throw error;
    }
}

namespace {

double axis_s(double way, double max_speed, const Pace& pace) {
  const double speed = pace.speed_fraction * max_speed;
  // A slower cruise speed is reached proportionally sooner.
  const double ramp_s = pace.speed_fraction * pace.ramp_s;
  return way > speed * ramp_s ? way / speed + ramp_s  // (65)
                              : 2.0 * std::sqrt(way * ramp_s / speed);
}

/// Time of the positioner's turn before a touch, while the arm waits.
double turn_s(const Robot& robot, const PlannedTouch& touch, const Pace& pace) {
  // The daemon turns an axis without a stated speed so unless configured otherwise.
  constexpr double kUsualRadS = 10.0 * kRadPerDeg;
  double slowest = 0.0;
  for (std::size_t j = 0; j < touch.wait_rad.size(); ++j) {
    const double stated = robot.positioner[j].max_speed_rad_s;
    slowest = std::max(slowest, axis_s(std::abs(touch.positioner_rad[j] - touch.wait_rad[j]),
                                       stated > 0.0 ? stated : kUsualRadS, pace));
  }
  return slowest > 0.0 ? slowest + pace.build_up_s : 0.0;
}

/// Over all way-points; corners are passed without stopping.
double transit_s(const Robot& robot, const JointVector& from, const PlannedTouch& touch,
                 const Pace& pace) {
  double sum = 0.0;
  const JointVector* at = &from;
  for (std::size_t k = 0; k < touch.transit.size(); ++k) {
    const double stop_s = move_s(robot, *at, touch.transit[k], pace);
    const bool passed = k > 0 && k <= touch.corners.size() && touch.corners[k - 1].in_share > 0.0 &&
                        touch.corners[k - 1].out_share > 0.0;
    sum += (passed ? pace.passed_share : 1.0) * stop_s;
    at = &touch.transit[k];
  }
  return sum;
}

/// Chords of this angle are 0.01 % shorter than the arc.
constexpr double kChordRad = 2.0 * kRadPerDeg;

std::vector<Eigen::Vector3d> points_m(const ArmModel& arm, std::span<const double> q) {
  std::vector<Eigen::Vector3d> points = arm.shape(arm.prepare(q), nullptr).joint_origin_m;
  for (int tool = 0; tool < arm.tool_count(); ++tool) points.push_back(arm.nominal_tip_m(q, tool));
  return points;
}

}  // namespace

double move_s(const Robot& robot, const JointVector& from, const JointVector& to,
              const Pace& pace) {
  double slowest = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i)
    slowest =
        std::max(slowest, axis_s(std::abs(to[i] - from[i]), robot.joints[i].max_speed_rad_s, pace));
  return slowest > 0.0 ? slowest + pace.build_up_s : 0.0;
}

double way_s(const Robot& robot, const JointVector& from, std::span<const JointVector> way,
             const Pace& pace) {
  double sum = 0.0;
  const JointVector* at = &from;
  for (const JointVector& next : way) {
    sum += (at == &from ? 1.0 : pace.passed_share) * move_s(robot, *at, next, pace);
    at = &next;
  }
  return sum;
}

double touch_s(double expected_m, const Pace& pace) {
  double confirmed_s = 0.0;
  for (int k = 0; k < pace.readings; ++k) {
    const double back_m = k == 0 ? pace.back_off_m : pace.slow_back_off_m;
    confirmed_s += back_m / pace.slow_m_s + back_m / pace.fast_m_s + 2.0 * pace.overhead_s;
  }
  return expected_m / pace.fast_m_s + pace.overhead_s + pace.confirmed_share * confirmed_s;
}

double duration_s(const Plan& plan, const Robot& robot, const Pace& pace) {
  double sum = 0.0;
  const JointVector* at = &plan.start;
  std::map<std::string, int> touched;
  for (const PlannedTouch& touch : plan.touches) {
    for (const JointVector& waypoint : touch.wait) {
      sum += move_s(robot, *at, waypoint, pace);
      at = &waypoint;
    }
    sum += turn_s(robot, touch, pace) + transit_s(robot, *at, touch, pace);
    const bool predicted = touched[touch.target]++ >= pace.unpredicted_touches;
    sum +=
        touch_s(predicted ? std::min(pace.predicted_m, touch.expected_m) : touch.expected_m, pace);
    sum += move_s(robot, touch.standoff, touch.clear, pace);
    at = &touch.clear;
  }
  for (const JointVector& waypoint : plan.home) {
    sum += move_s(robot, *at, waypoint, pace);
    at = &waypoint;
  }
  return sum;
}

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

std::vector<JointVector> stops_of(const Plan& plan, const JointVector& begin, std::size_t next) {
  std::vector<JointVector> stops{begin};
  const auto follow = [&](const std::vector<JointVector>& way) {
    stops.insert(stops.end(), way.begin(), way.end());
  };
  for (std::size_t k = next; k < plan.touches.size(); ++k) {
    const PlannedTouch& touch = plan.touches[k];
    follow(touch.wait);
    follow(touch.transit);
    follow({touch.standoff, touch.end, touch.clear});
  }
  follow(plan.home);
  return stops;
}

Turn AxisTravel::from(const JointVector& posture) const {
  Turn farthest;
  for (std::size_t i = 0; i < std::min(posture.size(), low_rad.size()); ++i) {
    const double angle = std::max(high_rad[i] - posture[i], posture[i] - low_rad[i]);
    if (angle > farthest.angle_rad) farthest = {i, angle};
  }
  return farthest;
}

Turn AxisTravel::from_anywhere() const {
  Turn farthest;
  for (std::size_t i = 0; i < low_rad.size(); ++i)
    if (const double angle = high_rad[i] - low_rad[i]; angle > farthest.angle_rad)
      farthest = {i, angle};
  return farthest;
}

AxisTravel axis_travel(const Plan& plan, const JointVector& begin, std::size_t next) {
  AxisTravel travel{begin, begin};
  for (const JointVector& stop : stops_of(plan, begin, next))
    for (std::size_t i = 0; i < std::min(stop.size(), begin.size()); ++i) {
      travel.low_rad[i] = std::min(travel.low_rad[i], stop[i]);
      travel.high_rad[i] = std::max(travel.high_rad[i], stop[i]);
    }
  return travel;
}

}  // namespace cellcal::calib
