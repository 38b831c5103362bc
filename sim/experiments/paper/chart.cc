#include "sim/experiments/paper/chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace cellcal::sim::paper {

namespace {

using svg::Anchor, svg::Paint, svg::Point, svg::Svg;

constexpr double kWidth = 760.0, kHeight = 420.0;
constexpr double kLeft = 78.0, kRight = 20.0, kTop = 66.0, kBottom = 52.0;
constexpr Paint kGrid{.stroke = "#e4e4e4"}, kFrame{.stroke = "#888"};
constexpr Paint kTick{.fill = "#333", .font_size = 12.0}, kLabel{.fill = "#333", .font_size = 13.0};
constexpr Paint kTitle{.fill = "#111", .font_size = 15.0, .bold = true};
constexpr int kMostLabels = 9;

struct Axis {
  double low = 0.0, high = 1.0;
  std::vector<double> ticks;
};

/// 1, 2 or 5 times a power of ten, for about six ticks.
double nice_step(double span) {
  const double raw = span / 6.0;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (double factor : {1.0, 2.0, 5.0})
    if (raw <= factor * power) return factor * power;
  return 10.0 * power;
}

Axis linear_axis(double low, double high, bool from_zero) {
  if (from_zero) low = std::min(low, 0.0);
  if (!(high > low)) high = low + 1.0;
  const double step = nice_step(high - low);
  Axis axis{std::floor(low / step) * step, std::ceil(high / step) * step, {}};
  const int count = static_cast<int>(std::lround((axis.high - axis.low) / step));
  for (int i = 0; i <= count; ++i) axis.ticks.push_back(axis.low + i * step);
  return axis;
}

/// In decades: ticks are exponents.
Axis decade_axis(double low, double high) {
  Axis axis{std::floor(std::log10(low)), std::ceil(std::log10(high)), {}};
  if (axis.high <= axis.low) axis.high = axis.low + 1.0;
  const double step = std::ceil((axis.high - axis.low) / kMostLabels);
  for (double tick = axis.low; tick <= axis.high + 1e-9; tick += step) axis.ticks.push_back(tick);
  return axis;
}

struct Frame {
  Axis x, y;
  bool logarithmic;

  Point at(Point value) const {
    const double level = logarithmic ? std::log10(value.y) : value.y;
    return {kLeft + (value.x - x.low) / (x.high - x.low) * (kWidth - kLeft - kRight),
            kHeight - kBottom - (level - y.low) / (y.high - y.low) * (kHeight - kTop - kBottom)};
  }
};

Frame frame_of(const Chart& chart) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Point low{kInfinity, kInfinity}, high{-kInfinity, -kInfinity};
  for (const Series& series : chart.series) {
    for (const Point& point : series.points) {
      if (!std::isfinite(point.x) || !std::isfinite(point.y))
        throw std::invalid_argument(chart.title + ": a value of " + series.name + " is not finite");
      if (chart.logarithmic_y && !(point.y > 0.0))
        throw std::invalid_argument(chart.title + ": a value of " + series.name +
                                    " is not positive");
      low = {std::min(low.x, point.x), std::min(low.y, point.y)};
      high = {std::max(high.x, point.x), std::max(high.y, point.y)};
    }
  }
  if (!(low.x <= high.x)) throw std::invalid_argument(chart.title + ": nothing to draw");
  return {linear_axis(low.x, high.x, true),
          chart.logarithmic_y ? decade_axis(low.y, high.y) : linear_axis(low.y, high.y, true),
          chart.logarithmic_y};
}

std::string label(double value) {
  if (value != 0.0 && std::abs(value) < 1e-12) value = 0.0;
  return fmt::format("{:g}", std::round(value * 1e9) / 1e9);
}

void draw_frame(Svg& svg, const Chart& chart, const Frame& frame) {
  const double right = kWidth - kRight, bottom = kHeight - kBottom;
  for (double tick : frame.y.ticks) {
    const double y = frame.at({frame.x.low, frame.logarithmic ? std::pow(10.0, tick) : tick}).y;
    svg.line({kLeft, y}, {right, y}, kGrid);
    const std::string words = frame.logarithmic && (tick < -3.0 || tick > 3.0)
                                  ? fmt::format("1e{:g}", tick)
                                  : label(frame.logarithmic ? std::pow(10.0, tick) : tick);
    svg.text({kLeft - 8.0, y + 4.0}, Anchor::kEnd, kTick, words);
  }
  for (double tick : frame.x.ticks) {
    const double x = frame.at({tick, frame.logarithmic ? 1.0 : 0.0}).x;
    svg.line({x, bottom}, {x, bottom + 5.0}, kFrame);
    svg.text({x, bottom + 19.0}, Anchor::kMiddle, kTick, label(tick));
  }
  svg.line({kLeft, kTop}, {kLeft, bottom}, kFrame);
  svg.line({kLeft, bottom}, {right, bottom}, kFrame);
  svg.text({kLeft, 24.0}, Anchor::kStart, kTitle, chart.title);
  svg.text({(kLeft + right) / 2.0, kHeight - 12.0}, Anchor::kMiddle, kLabel, chart.x_label);
  svg.vertical_text({20.0, (kTop + bottom) / 2.0}, kLabel, chart.y_label);
}

void draw_legend(Svg& svg, const Chart& chart) {
  constexpr double kPerLetter = 6.6;  // 12 px sans-serif, upper estimate
  double x = kLeft;
  for (const Series& series : chart.series) {
    if (series.mark == Mark::kLine)
      svg.line({x, 46.0}, {x + 18.0, 46.0}, Paint{.stroke = series.colour, .stroke_width = 2.5});
    else
      svg.circle({x + 9.0, 46.0}, 4.0, Paint{.fill = series.colour});
    svg.text({x + 24.0, 50.0}, Anchor::kStart, kTick, series.name);
    x += 24.0 + kPerLetter * static_cast<double>(series.name.size()) + 18.0;
  }
}

}  // namespace

std::string draw(const Chart& chart) {
  const Frame frame = frame_of(chart);
  Svg svg(kWidth, kHeight);
  draw_frame(svg, chart, frame);
  draw_legend(svg, chart);
  for (const Series& series : chart.series) {
    std::vector<Point> pixels;
    for (const Point& point : series.points) pixels.push_back(frame.at(point));
    if (series.mark == Mark::kLine)
      svg.path(pixels, Paint{.stroke = series.colour, .stroke_width = 2.0});
    for (const Point& pixel : pixels)
      svg.circle(pixel, series.mark == Mark::kDot ? 3.6 : 2.2, Paint{.fill = series.colour});
  }
  return std::move(svg).finish();
}

}  // namespace cellcal::sim::paper
