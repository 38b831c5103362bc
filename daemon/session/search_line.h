#pragma once
// Geometry along one search, and agreement of the readings of one touch.
//
// A search is a straight line in joint space from the stand-off to the end; over its 18 mm the tip deviates
// from a straight line in space by micrometres only. Travel along it is the fraction of the joint distance
// times the plan's tip path.

#include <optional>
#include <vector>

#include "calib/model/touch.h"
#include "calib/plan/plan.h"
#include "daemon/session/action.h"
#include "daemon/session/touch_policy.h"

namespace cellcal::daemon {

drivers::AxisAngles axis_angles(const calib::JointVector& joint_rad);
calib::JointVector joint_vector(const drivers::AxisAngles& axes_rad);

/// Tip travel [m] from the stand-off to the point of the search line nearest to these joints.
double travel_m(const calib::PlannedTouch& planned, const drivers::AxisAngles& axes_rad);
/// Joint angles [rad] at this travel [m].
drivers::AxisAngles at_travel(const calib::PlannedTouch& planned, double travel_m);

/// Travel [m] at which the search for the expected contact begins: 0 (the stand-off) without an expectation,
/// and never beyond the nominal surface.
double approach_m(const calib::PlannedTouch& planned, const calib::ExpectedContact& expected,
                  const TouchPolicy& policy);
/// True if one fast contact is not sufficient; see TouchPolicy.
bool is_surprising(const Reading& reading, const calib::ExpectedContact& expected,
                   const TouchPolicy& policy);

/// Agreeing readings, ordered by travel.
struct Agreement {
  std::vector<Reading> readings;
  double spread_m = 0.0;
};

/// The closest `policy.readings` of all, if they lie within the tolerance.
std::optional<Agreement> find_agreement(std::vector<Reading> readings, const TouchPolicy& policy);

/// The touch: joints of the middle reading, or the mean of the two middle ones. `speed_m_s`: search speed of
/// the readings.
calib::Touch touch_of(const calib::PlannedTouch& planned, const Agreement& agreement,
                      double speed_m_s);

}  // namespace cellcal::daemon
