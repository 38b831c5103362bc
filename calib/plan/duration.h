#pragma once
// How long the robot needs, so that plans can be compared: transits with speed and acceleration
// limits, searches at their speeds. No clock comes in.

#include <span>

#include "calib/model/kinematics.h"
#include "calib/plan/planned_touch.h"

namespace cellcal::calib {

struct Pace {
  double speed_fraction = 1.0;  ///< of the robot file's axis speeds
  /// From rest to full speed, and how long the acceleration takes to build up. No maker publishes
  /// them; arms for some ten kilograms take about this.
  double ramp_s = 0.3, build_up_s = 0.1;
  /// What a leg behind a way-point that is passed takes of its time from rest to rest.
  double passed_share = 0.85;
  double fast_m_s = 0.010, slow_m_s = 0.004;  ///< searches
  /// A search begins so far before the contact where the touches so far predict it, on the mean
  /// over a session; of the first touches of each target they do not.
  double predicted_m = 0.005;
  int unpredicted_touches = 4;
  /// Share of the touches whose contact is confirmed, and slow searches then.
  double confirmed_share = 0.16;
  int readings = 2;
  double back_off_m = 0.0010,
         slow_back_off_m = 0.0006;  ///< before the first slow search, the others
  double overhead_s = 0.25;  ///< starting, stopping, settling, per search with what leads to it
};

/// Throws PlanError naming the first joint whose speed the robot file does not state: without it
/// nobody knows how fast the arm may be moved, nor how long a plan takes.
void require_speeds(const Robot& robot);

/// Joint-space move from rest to rest: the slowest axis, its ramps limited in acceleration and
/// jerk.
double move_s(const Robot& robot, const JointVector& from, const JointVector& to, const Pace& pace);

/// Over way-points, each of which is passed.
double way_s(const Robot& robot, const JointVector& from, std::span<const JointVector> way,
             const Pace& pace);

/// From where the search begins, this far before the contact, to the last contact; in the mean over
/// those that are confirmed and those that are not.
double touch_s(double expected_m, const Pace& pace);

/// The whole plan: transits, searches to the expected surface, retreats, and home.
double duration_s(const Plan& plan, const Robot& robot, const Pace& pace);

// How fast points of the arm move while the axes go straight from one posture to another: what the
// controller bounds in T1, where the axes' own limits say nothing of it.

/// Largest speed of a joint's origin (elbow, wrist), the flange or a TCP on the straight line in joint
/// space from `from` to `to` [rad], run at constant speed in one second [m/s]. Nominal arm; within 1 %.
double fastest_point_m_s(const ArmModel& arm, std::span<const double> from,
                         std::span<const double> to);

// How far the axes go in a plan. A controller that adds corrections to where its program stands
// bounds how far each axis may go from there.

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
