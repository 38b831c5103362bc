#pragma once
// The few touches that tell soonest and most surely whether a calibration still holds, and what changed if
// it does not.

#include "calib/plan/reach/planned_touch.h"
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

}  // namespace cellcal::calib
