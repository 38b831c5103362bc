#include "calib/plan/check_plan.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/identify/update.h"
#include "calib/plan/candidates.h"
#include "calib/plan/check_choice.h"
#include "calib/plan/few_touches.h"
#include "calib/plan/plan.h"

namespace cellcal::calib {

Plan make_check_plan(const Calibration& calibration, const PlanOptions& options,
                     const CheckPlanOptions& how, const JointVector& from) {
  return make_few_touches(calibration, options, how, from,
                          [&](const std::vector<Candidate>& candidates, int count,
                              const std::function<bool(std::size_t)>& possible) {
                            return how.joints.empty()
                                       ? choose_check(calibration, candidates, count, possible)
                                       : choose_for_zeros(calibration, how.joints, candidates,
                                                          count, possible);
                          });
}

CheckPlanOptions mastered_touches(const std::vector<std::string>& joints) {
  CheckPlanOptions how;
  how.most_touches = 6;
  how.least_touches = 4;
  how.before_m = 0.006;
  how.joints = joints;
  return how;
}

PlannedTouch check_touch_from(const Calibration& calibration, const Plan& plan, std::size_t next,
                              const JointVector& from) {
  const PlannedTouch& planned = plan.touches.at(next);
  const JointVector& before = next == 0 ? plan.start : plan.touches[next - 1].clear;
  if (from == before) return planned;
  // To the stand-off clear of the sphere, then straight on as planned.
  Plan far = plan;
  const bool aimed = planned.transit.size() > 1 && planned.transit.back() == planned.standoff;
  if (aimed) far.touches[next].standoff = planned.transit[planned.transit.size() - 2];
  PlannedTouch touch = resume_plan(as_known(calibration), far, next, from).touches[next];
  if (!aimed) return touch;
  touch.standoff = planned.standoff;
  touch.transit.push_back(planned.standoff);
  touch.corners.clear();
  touch.leaving = {};
  return touch;
}

CheckPlanOptions first_update_touches() {
  CheckPlanOptions how;
  how.before_m = 0.006;
  how.most_s = kMostUpdateS / 2.0;
  how.set = TouchSet::kFit;
  return how;
}

CheckPlanOptions further_update_touches(int touches_made, double seconds) {
  CheckPlanOptions how = first_update_touches();
  how.most_touches = kMostUpdateTouches - touches_made;
  how.least_touches = 1;
  how.most_s = kMostUpdateS - seconds;
  return how;
}

Plan make_update_plan(const Calibration& believed, const PlanOptions& options,
                      const CheckPlanOptions& how, const JointVector& from) {
  return make_few_touches(believed, options, how, from,
                          [&](const std::vector<Candidate>& candidates, int count,
                              const std::function<bool(std::size_t)>& possible) {
                            return choose_update(believed, candidates, count, possible);
                          });
}

namespace {

bool can_be_touched(const Target& target) {
  return target.kind == TargetKind::kSphere && target.has_centre &&
         is_planned(target, Kinds::kSpheresAndPlanes);
}

/// The same touch again, from its clear point.
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
  for (Target& other : one.targets) other.obstacle_only = other.id != touched;
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
