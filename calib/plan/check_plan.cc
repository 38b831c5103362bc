#include "calib/plan/check_plan.h"

#include "calib/plan/choice/check_choice.h"
#include "calib/plan/few_touches.h"
#include "calib/plan/plan.h"

namespace cellcal::calib {

Plan make_check_plan(const Calibration& calibration, const PlanOptions& options,
                     const CheckPlanOptions& how, const JointVector& from) {
  return make_few_touches(calibration, options, how, from,
                          [&](const std::vector<Candidate>& candidates, int count,
                              const std::function<bool(std::size_t)>& possible) {
                            return choose_check(calibration, candidates, count, possible);
                          });
}

PlannedTouch check_touch_from(const Calibration& calibration, const Plan& plan, std::size_t next,
                              const JointVector& from) {
  const PlannedTouch& planned = plan.touches.at(next);
  const JointVector& before = next == 0 ? plan.start : plan.touches[next - 1].clear;
  if (from == before) return planned;
  // To the stand-off that keeps clear of the sphere, and straight on from there as planned.
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

}  // namespace cellcal::calib
