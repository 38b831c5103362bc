#include "calib/plan/update_plan.h"

#include "calib/plan/choice/update_choice.h"
#include "calib/plan/few_touches.h"
#include "calib/update/update.h"

namespace cellcal::calib {

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

}  // namespace cellcal::calib
