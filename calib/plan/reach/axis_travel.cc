#include "calib/plan/reach/axis_travel.h"

#include <algorithm>

namespace cellcal::calib {

namespace {

void widen(AxisTravel& travel, const JointVector& posture) {
  for (std::size_t i = 0; i < std::min(posture.size(), travel.low_rad.size()); ++i) {
    travel.low_rad[i] = std::min(travel.low_rad[i], posture[i]);
    travel.high_rad[i] = std::max(travel.high_rad[i], posture[i]);
  }
}

}  // namespace

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
  for (std::size_t k = next; k < plan.touches.size(); ++k) {
    const PlannedTouch& touch = plan.touches[k];
    for (const JointVector& waypoint : touch.transit) widen(travel, waypoint);
    for (const JointVector* posture : {&touch.standoff, &touch.end, &touch.clear})
      widen(travel, *posture);
  }
  for (const JointVector& waypoint : plan.home) widen(travel, waypoint);
  return travel;
}

}  // namespace cellcal::calib
