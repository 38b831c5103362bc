#include "calib/plan/choice/forecast.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace cellcal::calib {

int touches_by_trend(const std::vector<std::pair<int, double>>& bounds, double goal_m, int most) {
  constexpr std::size_t kLeast = 8, kLate = 16;
  const std::size_t count = std::min(kLate, bounds.size());
  if (count < kLeast) return most;
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (std::size_t k = bounds.size() - count; k < bounds.size(); ++k) {
    const double log_touches = std::log(bounds[k].first), log_u95 = std::log(bounds[k].second);
    n += 1.0;
    x += log_touches;
    y += log_u95;
    xx += log_touches * log_touches;
    xy += log_touches * log_u95;
  }
  const double power = (x * y - n * xy) / (n * xx - x * x);
  constexpr double kStandingStill = 0.1;
  if (!(power > kStandingStill)) return most;
  const auto& [touches, u95_m] = bounds.back();
  const double more = touches * (std::pow(u95_m / goal_m, 1.0 / power) - 1.0);  // (69)
  return static_cast<int>(std::clamp(std::ceil(more), 1.0, static_cast<double>(std::max(1, most))));
}

}  // namespace cellcal::calib
