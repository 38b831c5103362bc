#include "daemon/report/axes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "daemon/report/say.h"

namespace cellcal::daemon::report {

namespace {

using svg::Point;

constexpr double kLetterWidth = 8.0;  // px
constexpr double kLetterHeight = 13.0;
constexpr double kBaseLine = 10.5;  // below the top of a letter
constexpr double kGap = 5.0;

// A narrower relative range has no ticks distinguishable in double precision.
constexpr double kLeastRelativeRange = 1e-9;
constexpr int kMostDecimals = 9;

}  // namespace

void Labels::keep_free(Point corner, double width, double height) {
  taken_.push_back({corner.x, corner.y, corner.x + width, corner.y + height});
}

Point Labels::beside(Point centre, double radius, std::size_t letters) {
  const double width = kLetterWidth * static_cast<double>(letters), gap = radius + kGap;
  const std::array<Point, 4> corners{{{centre.x + gap, centre.y - 0.5 * kLetterHeight},
                                      {centre.x - gap - width, centre.y - 0.5 * kLetterHeight},
                                      {centre.x - 0.5 * width, centre.y - gap - kLetterHeight},
                                      {centre.x - 0.5 * width, centre.y + gap}}};
  Point chosen = corners[0];
  for (const Point& corner : corners) {
    const Box box{corner.x, corner.y, corner.x + width, corner.y + kLetterHeight};
    const bool inside = box.left >= left_ && box.right <= right_ && box.top >= top_;
    if (inside && std::none_of(taken_.begin(), taken_.end(),
                               [&box](const Box& other) { return box.overlaps(other); })) {
      chosen = corner;
      break;
    }
  }
  keep_free(chosen, width, kLetterHeight);
  return {chosen.x, chosen.y + kBaseLine};
}

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

void draw_value_axis(svg::Svg& svg, const Scale& across, const Scale& up, int wanted, double gap) {
  const std::vector<double> ticks = round_ticks(up.from, up.to, wanted);
  const std::vector<std::string> labels = tick_labels(ticks);
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const double y = up(ticks[i]);
    svg.line({across.at_from, y}, {across.at_to, y}, ticks[i] == 0.0 ? "zero" : "grid");
    svg.text({across.at_from - gap, y + 4.0}, svg::Anchor::kEnd, "tick", labels[i]);
  }
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
