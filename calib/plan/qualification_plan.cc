#include "calib/plan/qualification_plan.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/plan/plan.h"
#include "calib/plan/reach/candidates.h"

namespace cellcal::calib {

namespace {

bool can_be_touched(const Target& target) {
  return target.kind == TargetKind::kSphere && target.has_centre &&
         is_planned(target, Kinds::kSpheresAndPlanes);
}

/// To the same touch again, from where the arm left it.
PlannedTouch again(PlannedTouch touch) {
  touch.transit = {touch.standoff};
  touch.corners.clear();
  touch.leaving = {};
  return touch;
}

}  // namespace

std::string qualification_target(const Cell& cell, std::string_view target) {
  std::string others;
  for (const Target& one : cell.targets) {
    if (!can_be_touched(one)) continue;
    if (target.empty() || one.id == target) return one.id;
    others += (others.empty() ? "" : ", ") + one.id;
  }
  if (target.empty())
    throw PlanError(
        PlanError::Kind::kCell,
        "no sphere with centre_mm: a qualification needs one. Add centre_mm to the cell file");
  throw PlanError(PlanError::Kind::kRequest, std::string(target),
                  fmt::format("target {}: no sphere with centre_mm of that name. There are: {}",
                              target, others.empty() ? "none" : others));
}

Plan make_qualification_plan(const Cell& cell, const PlanOptions& options, std::string_view target,
                             int places, std::span<const double> speeds_m_s) {
  const std::string touched = qualification_target(cell, target);
  Cell one = cell;
  for (Target& other : one.targets) other.only_in_the_way = other.id != touched;
  PlanOptions few = options;
  few.fit_touches = places;
  few.check_touches = 0;
  few.criterion = Criterion::kEven;
  const Plan once = make_plan(one, few);
  Plan plan = once;
  plan.touches.clear();
  plan.predicted_mean_m = plan.predicted_u95_m = 0.0;
  for (const PlannedTouch& touch : once.touches)
    for (const double speed : speeds_m_s) {
      const bool first = plan.touches.empty() || plan.touches.back().end != touch.end;
      plan.touches.push_back(first ? touch : again(touch));
      plan.touches.back().search_m_s = speed;
    }
  return plan;
}

}  // namespace cellcal::calib
