#include "calib/verdict/judge/temperature.h"

#include <algorithm>

namespace cellcal::calib {

std::optional<Finding> temperature_finding(std::span<const Touch> touches) {
  double coldest = 0.0, hottest = 0.0;
  std::size_t stated = 0;
  for (const Touch& touch : touches) {
    if (!touch.temperature_c) continue;
    coldest = stated == 0 ? *touch.temperature_c : std::min(coldest, *touch.temperature_c);
    hottest = stated == 0 ? *touch.temperature_c : std::max(hottest, *touch.temperature_c);
    ++stated;
  }
  if (stated == 0) return std::nullopt;
  Finding finding{FindingKind::kTemperature, Severity::kInforms};
  finding.evidence = {{"coldest", coldest, "degrees C"},
                      {"hottest", hottest, "degrees C"},
                      {"stated", static_cast<double>(stated), ""},
                      {"touches", static_cast<double>(touches.size()), ""}};
  return finding;
}

}  // namespace cellcal::calib
