#include "calib/verdict/moved_parameters.h"

#include <algorithm>
#include <cmath>

namespace cellcal::calib {

std::vector<MovedParameter> moved_parameters(const Calibration& before, const Calibration& after) {
  constexpr double kCoverage = 2.0;
  std::vector<MovedParameter> moved;
  for (const ParameterResult& now : after.parameters) {
    const ParameterResult* was = find(before, now.key);
    if (was == nullptr || was->decided_by == DecidedBy::kFrame ||
        now.decided_by == DecidedBy::kFrame)
      continue;
    MovedParameter one{now.key,
                       now.unit,
                       now.to_unit,
                       was->nominal + was->correction,
                       now.nominal + now.correction,
                       kCoverage * std::hypot(was->sigma, now.sigma)};
    if (std::abs(one.after - one.before) > one.expanded) moved.push_back(std::move(one));
  }
  std::ranges::stable_sort(moved, std::greater{}, [](const MovedParameter& one) {
    return one.expanded > 0.0 ? std::abs(one.after - one.before) / one.expanded : HUGE_VAL;
  });
  return moved;
}

}  // namespace cellcal::calib
