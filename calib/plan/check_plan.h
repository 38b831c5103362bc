#pragma once
// The few touches that tell soonest and most surely whether a calibration still holds, and what changed if
// it does not.

#include <span>
#include <string_view>

#include "calib/plan/planned_touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

struct CheckPlanOptions {
  int most_touches = 8, least_touches = 6;
  double most_s =
      20.0;  ///< robot time, from the start and back; fewer touches where more would take longer
  /// Search lines, by the calibrated arm: so far before the contact and behind it.
  double before_m = 0.004, behind_m = 0.012;
  TouchSet set = TouchSet::kCheck;  ///< what they are made for
};

/// Touches of the spheres of the calibration, around where it has them. Of PlanOptions the margins count, not
/// the numbers. `from`: where the arm is; empty: the resting posture. Throws PlanError.
Plan make_check_plan(const Calibration& calibration, const PlanOptions& options,
                     const CheckPlanOptions& how = {}, const JointVector& from = {});

/// The plan's touch `next`, spheres where that calibration has them, with a way from wherever the arm stands; as resume_plan(). Throws PlanError.
PlannedTouch check_touch_from(const Calibration& calibration, const Plan& plan, std::size_t next,
                              const JointVector& from);

// The touches of an update: first those of a check, then those that resolve what these have shown.

/// Longer search lines than a check's: a sphere may have moved by 5 mm.
CheckPlanOptions first_update_touches();
/// So many touches and so much robot time later; none left where `most_touches` is below 1.
CheckPlanOptions further_update_touches(int touches_made, double seconds);

/// Further touches around where the calibration so far has spheres and tip, chosen by what it leaves open.
/// `from`: where the arm is. Throws PlanError.
Plan make_update_plan(const Calibration& believed, const PlanOptions& options,
                      const CheckPlanOptions& how, const JointVector& from);

// Touches of one sphere that tell how good a contact is: few places all around it, each visited
// several times, at several speeds. Nothing of the arm's geometry is asked for.

/// `places` touches, far apart in direction and posture, each once per speed [m/s] in turn; the arm
/// leaves to the place's clear point in between and comes back on the same line. Other targets are
/// in the way and not touched. `target`: an id; empty: the first that can be planned. Throws PlanError.
Plan make_qualification_plan(const Cell& cell, const PlanOptions& options, std::string_view target,
                             int places, std::span<const double> speeds_m_s);

/// The target that it touches.
std::string qualification_target(const Cell& cell, std::string_view target);

}  // namespace cellcal::calib
