#pragma once
// Plans a few touches by a calibration that has the spheres and the tip: candidates, choice, paths, short
// search lines, within a time limit.

#include <functional>
#include <vector>

#include "calib/plan/candidates.h"
#include "calib/plan/check_plan.h"

namespace cellcal::calib {

/// Picks this many candidates by index; `possible` is called for each before it is picked.
using ChoiceOfFew =
    std::function<std::vector<std::size_t>(const std::vector<Candidate>& candidates, int count,
                                           const std::function<bool(std::size_t)>& possible)>;

/// The cell with spheres at their calibrated places; targets without one are obstacles. Throws PlanError if there is
/// no sphere.
Cell as_known(const Calibration& calibration);

/// As make_check_plan(). Throws PlanError.
Plan make_few_touches(const Calibration& calibration, const PlanOptions& options,
                      const CheckPlanOptions& how, const JointVector& from,
                      const ChoiceOfFew& choose);

}  // namespace cellcal::calib
