// Whitened residuals against the normal curve: is the scatter of a touch what it was taken to be?

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>
#include <vector>

#include "calib/svg/svg.h"
#include "daemon/report/drawing/scale.h"
#include "daemon/report/drawing/text.h"
#include "daemon/report/sections.h"

namespace cellcal::daemon::report {
namespace {

using svg::Anchor, svg::Point, svg::Svg;

constexpr double kHistogramWidth = 540.0;
constexpr double kHistogramHeight = 250.0;
constexpr double kHistogramLeft = 40.0;
constexpr double kHistogramRight = 10.0;
constexpr double kHistogramTop = 14.0;
constexpr double kHistogramBottom = 210.0;
constexpr double kBinWidth = 0.5;  // sigma
constexpr int kCurvePoints = 120;

double normal_density(double x) {
  return std::exp(-0.5 * x * x) / std::sqrt(2.0 * std::numbers::pi);
}

// Of the length of three normal errors: chi with three degrees of freedom.
double length_density(double x) { return 2.0 * x * x * normal_density(x); }

// What honest residuals look like: along one line, or in space where every target is a point.
struct Shape {
  double from, to;  // sigma; beyond them lie a few of 100 000 touches
  double peak;
  double (*density)(double);
  std::string_view curve, expected, expected_fitted;
};
constexpr Shape kAlongALine{
    -4.0, 4.0, 0.0, normal_density, "normal curve", "about 1", "below 1: the fit follows them"};
constexpr Shape kInSpace{0.0,
                         5.0,
                         std::numbers::sqrt2,
                         length_density,
                         "curve of a normal error in space",
                         "about 1.7",
                         "below 1.7: the fit follows them"};

struct Counts {
  explicit Counts(const Shape& shape)
      : fit(static_cast<std::size_t>((shape.to - shape.from) / kBinWidth)), check(fit.size()) {}

  std::vector<int> fit, check;  // per bin
  int fit_total = 0, check_total = 0, beyond = 0, on_points = 0;
  double fit_squares = 0.0, check_squares = 0.0;
};

Counts count(const View& view, const Shape& shape) {
  Counts counts(shape);
  for (const Mark& mark : view.marks) {
    if (mark.kind == MarkKind::kOutlier) continue;
    // Lengths beside signed residuals follow another curve.
    if (mark.in_3d && !view.points_only()) {
      ++counts.on_points;
      continue;
    }
    const bool held_out = mark.kind == MarkKind::kCheck;
    ++(held_out ? counts.check_total : counts.fit_total);
    (held_out ? counts.check_squares : counts.fit_squares) += mark.whitened * mark.whitened;
    if (mark.whitened <= -shape.to || mark.whitened >= shape.to) {
      ++counts.beyond;
      continue;
    }
    const double bins = std::max(0.0, (mark.whitened - shape.from) / kBinWidth);
    const auto bin = std::min(static_cast<std::size_t>(bins), counts.fit.size() - 1);
    ++(held_out ? counts.check : counts.fit)[bin];
  }
  return counts;
}

std::string draw(const Counts& counts, const Shape& shape) {
  const int total = counts.fit_total + counts.check_total;
  double highest = total * kBinWidth * shape.density(shape.peak);
  for (std::size_t i = 0; i < counts.fit.size(); ++i) {
    highest = std::max(highest, static_cast<double>(counts.fit[i] + counts.check[i]));
  }
  const Scale across{shape.from, shape.to, kHistogramLeft, kHistogramWidth - kHistogramRight};
  const Scale up{0.0, highest * 1.05, kHistogramBottom, kHistogramTop};
  Svg svg(kHistogramWidth, kHistogramHeight, "chart histogram",
          "Histogram of residuals divided by their sigma, with the curve of pure noise");
  const std::vector<double> ticks = round_ticks(0.0, up.to, 4);
  const std::vector<std::string> labels = tick_labels(ticks);
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    svg.line({kHistogramLeft, up(ticks[i])}, {kHistogramWidth - kHistogramRight, up(ticks[i])},
             ticks[i] == 0.0 ? "zero" : "grid");
    svg.text({kHistogramLeft - 7.0, up(ticks[i]) + 4.0}, Anchor::kEnd, "tick", labels[i]);
  }
  for (std::size_t i = 0; i < counts.fit.size(); ++i) {
    const double left = across(shape.from + static_cast<double>(i) * kBinWidth) + 1.0;
    const double width = across(kBinWidth) - across(0.0) - 2.0;
    const double fit_top = up(counts.fit[i]);
    if (counts.fit[i] > 0)
      svg.rectangle({left, fit_top}, width, kHistogramBottom - fit_top, "bar-fit");
    if (counts.check[i] > 0) {
      const double top = up(counts.fit[i] + counts.check[i]);
      svg.rectangle({left + 0.75, top}, width - 1.5, fit_top - top, "bar-check");
    }
  }
  std::vector<Point> curve;
  for (int i = 0; i <= kCurvePoints; ++i) {
    const double x = shape.from + (shape.to - shape.from) * i / kCurvePoints;
    curve.push_back({across(x), up(total * kBinWidth * shape.density(x))});
  }
  svg.path(curve, "curve");
  for (double sigma = shape.from; sigma <= shape.to; sigma += 1.0) {
    svg.text({across(sigma), kHistogramBottom + 18.0}, Anchor::kMiddle, "tick", fixed(sigma, 0));
  }
  svg.text({kHistogramLeft, kHistogramTop - 3.0}, Anchor::kStart, "tick", "touches");
  svg.text({kHistogramWidth - kHistogramRight, kHistogramBottom + 36.0}, Anchor::kEnd, "tick",
           "residual divided by its \xCF\x83");
  return std::move(svg).finish();
}

std::string scatter_words(int total, double squares) {
  return total > 0 ? fixed(std::sqrt(squares / total), 2) : std::string("\xE2\x80\x93");
}

std::string left_out(const Counts& counts, const Shape& shape) {
  std::string words;
  if (counts.beyond > 0) {
    words +=
        fmt::format("<p class=\"warn\">{} further out than {}&sigma; and not drawn.</p>\n",
                    counted(static_cast<std::size_t>(counts.beyond), "touch lies", "touches lie"),
                    fixed(shape.to, 0));
  }
  if (counts.on_points > 0) {
    words += fmt::format(
        "<p class=\"note\">{} not drawn: distances in space follow another curve.</p>\n",
        counted(static_cast<std::size_t>(counts.on_points), "touch on a point is",
                "touches on points are"));
  }
  return words;
}

}  // namespace

std::string residual_histogram(const View& view) {
  const Shape& shape = view.points_only() ? kInSpace : kAlongALine;
  const Counts counts = count(view, shape);
  if (counts.fit_total + counts.check_total == 0) {
    return section("distribution", "Residual distribution",
                   "<p>There are no residuals to count.</p>\n");
  }
  const std::string body = fmt::format(
      "<div class=\"beside\">\n<div class=\"scroll\">{}</div>\n<div>\n<p class=\"legend\"><i "
      "class=\"swatch fit\"></i>fitted <i class=\"swatch check\"></i>held out <i "
      "class=\"swatch curve\"></i>{}</p>\n<p>Residuals divided by their expected scatter. Bars "
      "that follow the curve: only touch noise is left. Wider: the model lacks an effect, or "
      "the stated touch &sigma; is too small. Narrower: the stated &sigma; is too large, or "
      "the touches are so few that the fit follows each of them. {}</p>\n<table "
      "class=\"pairs\">\n<tr><th scope=\"row\">rms, fitted ({})</th><td>{}</td></tr>\n<tr><th "
      "scope=\"row\">rms, held out ({})</th><td>{}</td></tr>\n</table>\n{}</div>\n</div>\n",
      draw(counts, shape), shape.curve,
      view.points_only()
          ? ""
          : "Held-out ones to one side: a common cause such as the trigger or a worn tip.",
      shape.expected_fitted, scatter_words(counts.fit_total, counts.fit_squares), shape.expected,
      scatter_words(counts.check_total, counts.check_squares), left_out(counts, shape));
  return section("distribution", "Residual distribution", body);
}

}  // namespace cellcal::daemon::report
