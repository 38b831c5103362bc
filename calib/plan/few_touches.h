#pragma once
// A few touches by a calibration that knows where spheres and tip are: candidates, a choice among them, ways,
// short search lines, and no more of them than the time allows.

#include <functional>
#include <vector>

#include "calib/plan/candidates.h"
#include "calib/plan/check_plan.h"

namespace cellcal::calib {

/// Picks so many of the candidates, by index; `possible` is asked of one before it is picked.
using ChoiceOfFew =
    std::function<std::vector<std::size_t>(const std::vector<Candidate>& candidates, int count,
                                           const std::function<bool(std::size_t)>& possible)>;

/// The cell with the spheres where the calibration has them; what it has no place of is in the way. Throws PlanError
/// where there is none.
Cell as_known(const Calibration& calibration);

/// As make_check_plan(). Throws PlanError.
Plan make_few_touches(const Calibration& calibration, const PlanOptions& options,
                      const CheckPlanOptions& how, const JointVector& from,
                      const ChoiceOfFew& choose);

}  // namespace cellcal::calib
