#pragma once
// The touches of an update: first those of a check, then those that resolve what these have shown.

#include "calib/plan/check_plan.h"

namespace cellcal::calib {

/// Longer search lines than a check's: a sphere may have moved by 5 mm.
CheckPlanOptions first_update_touches();
/// So many touches and so much robot time later; none left where `most_touches` is below 1.
CheckPlanOptions further_update_touches(int touches_made, double seconds);

/// Further touches around where the calibration so far has spheres and tip, chosen by what it leaves open.
/// `from`: where the arm is. Throws PlanError.
Plan make_update_plan(const Calibration& believed, const PlanOptions& options,
                      const CheckPlanOptions& how, const JointVector& from);

}  // namespace cellcal::calib
