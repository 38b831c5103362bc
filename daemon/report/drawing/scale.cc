#include "daemon/report/drawing/scale.h"

#include <algorithm>
#include <cmath>

#include "daemon/report/drawing/text.h"

namespace cellcal::daemon::report {
namespace {

// A range narrower than this part of its own magnitude has no ticks that doubles can tell apart.
constexpr double kLeastRelativeRange = 1e-9;
constexpr int kMostDecimals = 9;

}  // namespace

double Scale::operator()(double value) const {
  return at_from + (value - from) / (to - from) * (at_to - at_from);
}

double Scale::clamped(double value) const {
  return (*this)(std::clamp(value, std::min(from, to), std::max(from, to)));
}

bool Scale::holds(double value) const {
  return value >= std::min(from, to) && value <= std::max(from, to);
}

std::vector<double> round_ticks(double from, double to, int wanted) {
  const double magnitude = std::max(std::abs(from), std::abs(to));
  if (!std::isfinite(magnitude) || !std::isfinite(to - from) || wanted < 1) return {};
  if (!(to - from > kLeastRelativeRange * magnitude)) return {};
  const double raw = (to - from) / wanted;
  const double decade = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10.0 * decade;
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * decade >= raw * (1.0 - kLeastRelativeRange)) {
      step = factor * decade;
      break;
    }
  }
  std::vector<double> ticks;
  const double first = std::ceil(from / step - kLeastRelativeRange);
  const double last = std::floor(to / step + kLeastRelativeRange);
  for (double i = first; i <= last; i += 1.0) ticks.push_back(i * step);
  return ticks;
}

std::vector<std::string> tick_labels(const std::vector<double>& ticks) {
  int decimals = 0;
  if (ticks.size() > 1) {
    const double step = ticks[1] - ticks[0];
    decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-6)), 0, kMostDecimals);
  }
  std::vector<std::string> labels;
  labels.reserve(ticks.size());
  for (const double tick : ticks) labels.push_back(fixed(tick, decimals));
  return labels;
}

double round_up(double value, double fallback) {
  if (!std::isfinite(value) || value <= 0.0) return fallback;
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double factor : {1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0}) {
    if (factor * decade >= value * (1.0 - kLeastRelativeRange)) return factor * decade;
  }
  return 10.0 * decade;
}

}  // namespace cellcal::daemon::report
