#include "calib/verdict/parameter_differences.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

namespace cellcal::calib {

ParameterDifferences parameter_differences(const Calibration& before, const Calibration& after) {
  constexpr double kCoverage = 2.0;
  std::map<std::string, const ParameterResult*, std::less<>> were;
  for (const ParameterResult& was : before.parameters)
    were.emplace(parameter_name(before.cell, was.key), &was);
  ParameterDifferences differences;
  for (const ParameterResult& now : after.parameters) {
    std::string name = parameter_name(after.cell, now.key);
    const auto found = were.find(name);
    if (found == were.end()) {
      differences.only_after.push_back(std::move(name));
      continue;
    }
    const ParameterResult& was = *found->second;
    were.erase(found);
    if (was.decided_by == DecidedBy::kFrame || now.decided_by == DecidedBy::kFrame) continue;
    MovedParameter one{std::move(name),
                       now.unit,
                       now.to_unit,
                       was.nominal + was.correction,
                       now.nominal + now.correction,
                       kCoverage * std::hypot(was.sigma, now.sigma)};
    if (std::abs(one.after - one.before) > one.expanded)
      differences.moved.push_back(std::move(one));
  }
  for (const ParameterResult& was : before.parameters)
    if (std::string name = parameter_name(before.cell, was.key); were.contains(name))
      differences.only_before.push_back(std::move(name));
  std::ranges::stable_sort(differences.moved, std::greater{}, [](const MovedParameter& one) {
    return one.expanded > 0.0 ? std::abs(one.after - one.before) / one.expanded : HUGE_VAL;
  });
  return differences;
}

}  // namespace cellcal::calib
