// Whitened residuals against the normal curve: is the scatter of a touch what it was taken to be?

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "daemon/report/scale.h"
#include "daemon/report/sections.h"
#include "daemon/report/svg.h"
#include "daemon/report/text.h"

namespace cellcal::daemon::report {
namespace {

constexpr double kWidth = 540.0;
constexpr double kHeight = 250.0;
constexpr double kLeft = 40.0;
constexpr double kRight = 10.0;
constexpr double kTop = 14.0;
constexpr double kBottom = 210.0;
constexpr double kReach = 4.0;  // sigma; beyond it lie six of 100 000 touches
constexpr double kBinWidth = 0.5;
constexpr std::size_t kBins = static_cast<std::size_t>(2.0 * kReach / kBinWidth);
constexpr int kCurvePoints = 120;

struct Counts {
  std::array<int, kBins> fit{};
  std::array<int, kBins> check{};
  int fit_total = 0, check_total = 0, beyond = 0;
  double fit_squares = 0.0, check_squares = 0.0;
};

Counts count(const std::vector<Mark>& marks) {
  Counts counts;
  for (const Mark& mark : marks) {
    if (mark.kind == MarkKind::kOutlier) continue;
    const bool held_out = mark.kind == MarkKind::kCheck;
    ++(held_out ? counts.check_total : counts.fit_total);
    (held_out ? counts.check_squares : counts.fit_squares) += mark.whitened * mark.whitened;
    if (std::abs(mark.whitened) >= kReach) {
      ++counts.beyond;
      continue;
    }
    const auto bin = static_cast<std::size_t>((mark.whitened + kReach) / kBinWidth);
    ++(held_out ? counts.check : counts.fit)[std::min(bin, kBins - 1)];
  }
  return counts;
}

double normal_density(double x) {
  return std::exp(-0.5 * x * x) / std::sqrt(2.0 * std::numbers::pi);
}

std::string draw(const Counts& counts) {
  const int total = counts.fit_total + counts.check_total;
  double highest = total * kBinWidth * normal_density(0.0);
  for (std::size_t i = 0; i < kBins; ++i) {
    highest = std::max(highest, static_cast<double>(counts.fit[i] + counts.check[i]));
  }
  const Scale across{-kReach, kReach, kLeft, kWidth - kRight};
  const Scale up{0.0, highest * 1.05, kBottom, kTop};
  Svg svg(kWidth, kHeight, "chart histogram",
          "Histogram of residuals divided by their sigma, against the normal curve");
  const std::vector<double> ticks = round_ticks(0.0, up.to, 4);
  const std::vector<std::string> labels = tick_labels(ticks);
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    svg.line({kLeft, up(ticks[i])}, {kWidth - kRight, up(ticks[i])},
             ticks[i] == 0.0 ? "zero" : "grid");
    svg.text({kLeft - 7.0, up(ticks[i]) + 4.0}, Anchor::kEnd, "tick", labels[i]);
  }
  for (std::size_t i = 0; i < kBins; ++i) {
    const double left = across(-kReach + static_cast<double>(i) * kBinWidth) + 1.0;
    const double width = across(kBinWidth) - across(0.0) - 2.0;
    const double fit_top = up(counts.fit[i]);
    if (counts.fit[i] > 0) svg.rectangle({left, fit_top}, width, kBottom - fit_top, "bar-fit");
    if (counts.check[i] > 0) {
      const double top = up(counts.fit[i] + counts.check[i]);
      svg.rectangle({left + 0.75, top}, width - 1.5, fit_top - top, "bar-check");
    }
  }
  std::vector<Point> curve;
  for (int i = 0; i <= kCurvePoints; ++i) {
    const double x = -kReach + 2.0 * kReach * i / kCurvePoints;
    curve.push_back({across(x), up(total * kBinWidth * normal_density(x))});
  }
  svg.path(curve, "curve");
  for (int sigma = -4; sigma <= 4; ++sigma) {
    svg.text({across(sigma), kBottom + 18.0}, Anchor::kMiddle, "tick", fixed(sigma, 0));
  }
  svg.text({kWidth - kRight, kBottom + 36.0}, Anchor::kEnd, "tick",
           "residual divided by its \xCF\x83");
  return std::move(svg).finish();
}

std::string scatter_words(int total, double squares) {
  return total > 0 ? fixed(std::sqrt(squares / total), 2) : std::string("\xE2\x80\x93");
}

}  // namespace

std::string residual_histogram(const View& view) {
  const Counts counts = count(view.marks);
  if (counts.fit_total + counts.check_total == 0) {
    return section("distribution", "Are the residuals what noise would leave?",
                   "<p>There are no residuals to count.</p>\n");
  }
  const std::string beyond =
      counts.beyond > 0
          ? fmt::format(
                "<p class=\"warn\">{} further out than 4&sigma; and not drawn.</p>\n",
                counted(static_cast<std::size_t>(counts.beyond), "touch lies", "touches lie"))
          : std::string();
  const std::string body = fmt::format(
      "<div class=\"beside\">\n<div class=\"scroll\">{}</div>\n<div>\n"
      "<p class=\"legend\"><i class=\"swatch fit\"></i>fitted <i class=\"swatch check\"></i>held "
      "out "
      "<i class=\"swatch curve\"></i>normal curve</p>\n"
      "<p>Each residual is divided by the scatter it should have. Bars that follow the curve mean: "
      "what is left is the noise of touching. Much wider: the model lacks something, or the stated "
      "touch &sigma; is too small. Shifted: the effective radius is off.</p>\n"
      "<table class=\"pairs\">\n"
      "<tr><th scope=\"row\">rms, fitted (a little below 1)</th><td>{}</td></tr>\n"
      "<tr><th scope=\"row\">rms, held out (about 1)</th><td>{}</td></tr>\n</table>\n{}</div>\n"
      "</div>\n",
      draw(counts), scatter_words(counts.fit_total, counts.fit_squares),
      scatter_words(counts.check_total, counts.check_squares), beyond);
  return section("distribution", "Are the residuals what noise would leave?", body);
}

}  // namespace cellcal::daemon::report
