#pragma once
// How far the axes go in a plan. A controller that adds corrections to where its program stands
// bounds how far each axis may go from there.

#include "calib/plan/reach/planned_touch.h"

namespace cellcal::calib {

/// An axis and an angle.
struct Turn {
  std::size_t axis = 0;
  double angle_rad = 0.0;
};

/// Between which angles each axis moves. Moves are straight in joint space: waypoints say it all.
struct AxisTravel {
  JointVector low_rad, high_rad;

  /// The farthest that an axis goes from a posture.
  Turn from(const JointVector& posture) const;
  /// The farthest that one goes from anywhere on the way.
  Turn from_anywhere() const;
};

/// With the arm at `begin`, from touch `next` on, and the way home.
AxisTravel axis_travel(const Plan& plan, const JointVector& begin, std::size_t next = 0);

}  // namespace cellcal::calib
