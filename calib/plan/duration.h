#pragma once
// Duration model of the robot, for comparing plans: transits with speed and acceleration limits,
// searches at their speeds. Independent of any clock.

#include <span>

#include "calib/model/kinematics.h"
#include "calib/plan/planned_touch.h"

namespace cellcal::calib {

struct Pace {
  double speed_fraction = 1.0;  ///< of the robot file's axis speeds
  /// Time from rest to full speed, and build-up time of the acceleration. Not published by
  /// manufacturers; typical for arms of about ten kilograms of payload.
  double ramp_s = 0.3, build_up_s = 0.1;
  /// Duration of a leg after a passed way-point, relative to rest-to-rest.
  double passed_share = 0.85;
  double fast_m_s = 0.010, slow_m_s = 0.004;  ///< searches
  /// Mean distance from the start of a search to the predicted contact, over a session; the first
  /// touches of each target are not predicted.
  double predicted_m = 0.005;
  int unpredicted_touches = 4;
  /// Share of the touches with confirmation by slow searches.
  double confirmed_share = 0.16;
  int readings = 2;
  double back_off_m = 0.0010,
         slow_back_off_m = 0.0006;  ///< before the first slow search; before further ones
  double overhead_s = 0.25;  ///< starting, stopping, settling, per search including its approach
};

/// Throws PlanError naming the first joint without a speed in the robot file; speed limit and
/// duration are undefined without it.
void require_speeds(const Robot& robot);

/// Joint-space move from rest to rest: the slowest axis, with limited acceleration and jerk.
double move_s(const Robot& robot, const JointVector& from, const JointVector& to, const Pace& pace);

/// Over way-points, all passed.
double way_s(const Robot& robot, const JointVector& from, std::span<const JointVector> way,
             const Pace& pace);

/// From the start of the search, this far before the contact, to the last contact; mean over
/// confirmed and unconfirmed ones.
double touch_s(double expected_m, const Pace& pace);

/// The whole plan: turns of the positioner, transits, searches to the expected surface, retreats, and return.
double duration_s(const Plan& plan, const Robot& robot, const Pace& pace);

// Speed of points of the arm during a straight move in joint space, which the controller limits in
// T1 independently of the axis limits.

/// Largest speed of a joint's origin (elbow, wrist), the flange or a TCP on the straight line in joint
/// space from `from` to `to` [rad], at constant speed in one second [m/s]. Nominal arm; within 1 %.
double fastest_point_m_s(const ArmModel& arm, std::span<const double> from,
                         std::span<const double> to);

// Axis travel of a plan. A controller that adds corrections to its programmed position limits the
// travel of each axis from there.

/// An axis and an angle.
struct Turn {
  std::size_t axis = 0;
  double angle_rad = 0.0;
};

/// Range of each axis. Moves are straight in joint space, so way-points are sufficient.
struct AxisTravel {
  JointVector low_rad, high_rad;

  /// Largest distance of any axis from a posture.
  Turn from(const JointVector& posture) const;
  /// Largest distance of any axis between two points of the plan.
  Turn from_anywhere() const;
};

/// All postures at which a move ends: from `begin` through touch `next` and all later ones, and back.
std::vector<JointVector> stops_of(const Plan& plan, const JointVector& begin, std::size_t next = 0);
/// Over these.
AxisTravel axis_travel(const Plan& plan, const JointVector& begin, std::size_t next = 0);

}  // namespace cellcal::calib
