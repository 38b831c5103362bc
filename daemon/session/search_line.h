#pragma once
// Geometry along one search, and when readings of one touch agree.
//
// A search is a straight line in joint space from the stand-off to the end; over its 18 mm the tip
// leaves the straight line in space by micrometres only. Travel along it is the fraction of the
// joint distance times the plan's tip path.

#include <optional>
#include <vector>

#include "calib/model/touch.h"
#include "calib/plan/plan.h"
#include "daemon/session/action.h"
#include "daemon/session/touch_policy.h"

namespace cellcal::daemon {

drivers::AxisAngles axis_angles(const calib::JointVector& joint_rad);
calib::JointVector joint_vector(const drivers::AxisAngles& axes_rad);

/// Tip travel [m] from the stand-off at which the arm's joints are nearest to the search line.
double travel_m(const calib::PlannedTouch& planned, const drivers::AxisAngles& axes_rad);
/// Joint angles at this travel [m].
drivers::AxisAngles at_travel(const calib::PlannedTouch& planned, double travel_m);

/// Travel [m] at which the search for a contact expected there begins: 0, the stand-off, where
/// nobody knows, and never behind the nominal surface.
double approach_m(const calib::PlannedTouch& planned, const calib::ExpectedContact& expected,
                  const TouchPolicy& policy);
/// Whether one fast contact says less than it should: see TouchPolicy.
bool is_surprising(const Reading& reading, const calib::ExpectedContact& expected,
                   const TouchPolicy& policy);

/// The readings that agree, ordered by travel.
struct Agreement {
  std::vector<Reading> readings;
  double spread_m = 0.0;
};

/// The closest `policy.readings` of all, if they lie within the tolerance.
std::optional<Agreement> find_agreement(std::vector<Reading> readings, const TouchPolicy& policy);

/// The touch: joints of the middle reading, or the mean of the two middle ones. `speed_m_s`: at
/// which they were made.
calib::Touch touch_of(const calib::PlannedTouch& planned, const Agreement& agreement,
                      double speed_m_s);

}  // namespace cellcal::daemon
