// Signed residual of every touch. Two panels with a common touch axis: the nominal robot on a scale of
// millimetres, the calibrated one on a scale of hundredths, since one linear axis would show only one of them
// and a logarithmic one would lose the sign.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/export/svg.h"
#include "calib/model/units.h"
#include "daemon/report/axes.h"
#include "daemon/report/report.h"

namespace cellcal::daemon::report {
namespace {

using svg::Anchor, svg::Point, svg::Svg;

constexpr double kChartWidth = 940.0;
constexpr double kChartLeft = 58.0;
constexpr double kChartRight = 10.0;
constexpr double kBeforeTop = 30.0;
constexpr double kBeforeHeight = 150.0;
constexpr double kAfterTop = 228.0;
constexpr double kAfterHeight = 190.0;
constexpr double kChartHeight = 462.0;
constexpr int kTicksPerPanel = 5;
constexpr int kTouchTicks = 12;
constexpr double kBandSigmas = 2.0;
constexpr double kBand3dSigmas = 2.795;  // of three squares 95 % are below its square
constexpr double kFallbackRangeMm = 0.1;
constexpr std::size_t kManyMarks = 150;  // from this number on smaller marks keep neighbours apart
constexpr double kFlagWidth = 118.0;     // px, width of "100: +0.62 off scale"
constexpr double kFlagGap = 9.0;

struct Panel {
  Scale across, up;
};

// Outliers do not determine the scale; they are drawn at its edge.
double range_of(const std::vector<Mark>& marks, double Mark::*value, double at_least) {
  double most = at_least;
  bool any = false;
  for (const Mark& mark : marks) {
    if (mark.kind == MarkKind::kOutlier) continue;
    most = std::max(most, std::abs(mark.*value));
    any = true;
  }
  if (!any) {
    for (const Mark& mark : marks) most = std::max(most, std::abs(mark.*value));
  }
  return round_up(most, kFallbackRangeMm);
}

void draw_frame(Svg& svg, const Panel& panel, std::string_view heading) {
  draw_value_axis(svg, panel.across, panel.up, kTicksPerPanel, 8.0);
  svg.text({0.0, panel.up.at_to - 15.0}, Anchor::kStart, "panel", heading);
}

void put_mark(Svg& svg, const View& view, const Mark& mark, Point at, double size,
              std::string_view look) {
  draw_mark(svg, view, mark, at, size, size * 1.45, look);
}

void draw_touch_axis(Svg& svg, const View& view, const Scale& across, double y) {
  const std::vector<Mark>& marks = view.marks;
  for (const double tick : round_ticks(across.from, across.to, kTouchTicks)) {
    // Ticks are at the index of the residual; the label is the number of the touch.
    if (tick < 1.0 || tick > static_cast<double>(marks.size()) || tick != std::floor(tick)) {
      continue;
    }
    const Mark& mark = marks[static_cast<std::size_t>(tick) - 1];
    svg.text({across(tick), y}, Anchor::kMiddle, "tick", fmt::format("{}", mark.number));
  }
  svg.text({across.at_to, y + 18.0}, Anchor::kEnd, "tick", view.say("say.report.residuals.axis"));
}

void draw_before(Svg& svg, const View& view, const Panel& panel, double size) {
  const std::vector<Mark>& marks = view.marks;
  draw_frame(svg, panel,
             view.say(view.result.update ? "say.report.residuals.before.update"
                                         : "say.report.residuals.before"));
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const double x = panel.across(static_cast<double>(i + 1));
    svg.line({x, panel.up(0.0)}, {x, panel.up.clamped(marks[i].before_mm)}, "stem");
  }
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const double x = panel.across(static_cast<double>(i + 1));
    put_mark(svg, view, marks[i], {x, panel.up.clamped(marks[i].before_mm)}, size, "before");
  }
  for (std::size_t i = 0; i < marks.size(); ++i) {
    if (marks[i].kind == MarkKind::kOutlier) continue;
    const double x = panel.across(static_cast<double>(i + 1));
    svg.circle({x, panel.up.clamped(marks[i].after_mm)}, size * 0.55, "collapsed");
  }
}

// End of the space for a label: the next outlier, or the panel's edge.
double next_outlier(const std::vector<Mark>& marks, std::size_t after, const Scale& across) {
  for (std::size_t i = after + 1; i < marks.size(); ++i) {
    if (marks[i].kind == MarkKind::kOutlier) return across(static_cast<double>(i + 1));
  }
  return across.at_to;
}

void draw_after(Svg& svg, const View& view, const Panel& panel, double size, double band_mm) {
  const std::vector<Mark>& marks = view.marks;
  if (band_mm > 0.0 && std::isfinite(band_mm)) {
    const double top = panel.up.clamped(band_mm);
    svg.rectangle({panel.across.at_from, top}, panel.across.at_to - panel.across.at_from,
                  panel.up.clamped(-band_mm) - top, "band");
  }
  draw_frame(svg, panel, view.say("say.report.residuals.after"));
  double label_end = panel.across.at_from;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const Mark& mark = marks[i];
    const Point at{panel.across(static_cast<double>(i + 1)), panel.up.clamped(mark.after_mm)};
    put_mark(svg, view, mark, at, size, "after");
    if (mark.kind != MarkKind::kOutlier) continue;
    // Every outlier is listed in the table; labels are drawn only where space permits.
    const double next = next_outlier(marks, i, panel.across);
    const bool to_the_right = at.x + kFlagWidth < next && at.x > label_end;
    const bool to_the_left = !to_the_right && at.x - kFlagWidth > label_end;
    label_end = at.x + (to_the_right ? kFlagWidth : kFlagGap);
    if (!to_the_right && !to_the_left) continue;
    svg.text(
        {at.x + (to_the_right ? kFlagGap : -kFlagGap), at.y + (mark.after_mm > 0.0 ? 10.0 : -3.0)},
        to_the_right ? Anchor::kStart : Anchor::kEnd, "flag",
        fmt::format(
            "{}: {}{}", mark.number, signed_fixed(mark.after_mm, 2),
            panel.up.holds(mark.after_mm) ? "" : " " + view.say("say.report.residuals.off_scale")));
  }
}

std::string legend() {
  constexpr double kSquare = 12.0, kSize = 3.4;
  constexpr std::array<std::pair<MarkKind, const char*>, 3> kMarks{
      {{MarkKind::kFit, "say.report.mark.fitted"},
       {MarkKind::kCheck, "say.report.mark.held_out"},
       {MarkKind::kOutlier, "say.report.mark.outlier"}}};
  std::string html = "<p class=\"legend\">";
  for (const auto& [kind, id] : kMarks) {
    const std::string words = say(id);
    Svg svg(kSquare, kSquare, "mark", words);
    draw_shape(svg, kind, {0.5 * kSquare, 0.5 * kSquare}, kSize, kSize * 1.45, "after", {});
    html += std::move(svg).finish() + words + "\n";
  }
  return html + "</p>\n";
}

std::string sign_words(const View& view) {
  if (view.points_only()) return say("say.report.residuals.sign.points");
  return say(view.any_point() ? "say.report.residuals.sign.mixed" : "say.report.residuals.sign");
}

bool any_off_scale(const View& view, double range_mm) {
  return std::any_of(view.marks.begin(), view.marks.end(),
                     [range_mm](const Mark& mark) { return std::abs(mark.after_mm) > range_mm; });
}

std::string note(const View& view, double band_mm, double range_mm) {
  std::string band;
  if (band_mm > 0.0)
    band =
        say({band_mm >= range_mm ? "say.report.residuals.band.whole" : "say.report.residuals.band",
             {{"mm", (view.points_only() ? "" : "&plusmn;") + fixed(band_mm, kMmDecimals)}}});
  return paragraph("note", sign_words(view) + band +
                               (any_off_scale(view, range_mm) ? say("say.report.residuals.beyond")
                                                              : std::string()) +
                               say("say.report.residuals.drift"));
}

std::string left_out(const View& view) {
  std::string words;
  if (view.unusable > 0)
    words += paragraph("warn", counted(view.unusable, "say.report.residuals.unusable."));
  if (view.unknown > 0)
    words += paragraph("warn", counted(view.unknown, "say.report.residuals.unknown."));
  return words;
}

/// Half width of the band that holds 95 % of the touches; 0: unknown.
double band_of(const View& view) {
  const double sigmas = view.points_only() ? kBand3dSigmas : kBandSigmas;
  const double band_mm = sigmas * view.result.cell.touch_sigma_m * calib::kMmPerM;
  return std::isfinite(band_mm) && band_mm > 0.0 ? band_mm : 0.0;
}

}  // namespace

std::string residual_plot(const View& view) {
  const std::vector<Mark>& marks = view.marks;
  if (marks.empty()) return "";
  const double before = range_of(marks, &Mark::before_mm, 0.0);
  const double after = range_of(marks, &Mark::after_mm, 0.0);
  const double lowest = view.points_only() ? 0.0 : -1.0;  // distances from points have no sign
  const Scale across{0.0, static_cast<double>(marks.size() + 1), kChartLeft,
                     kChartWidth - kChartRight};
  const Panel upper{across, {lowest * before, before, kBeforeTop + kBeforeHeight, kBeforeTop}};
  const Panel lower{across, {lowest * after, after, kAfterTop + kAfterHeight, kAfterTop}};
  const double size = marks.size() > kManyMarks ? 1.9 : 3.0;

  Svg svg(kChartWidth, kChartHeight, "chart residuals",
          view.say(view.result.update ? "say.report.residuals.picture.update"
                                      : "say.report.residuals.picture"));
  draw_before(svg, view, upper, size);
  draw_after(svg, view, lower, size, band_of(view));
  draw_touch_axis(svg, view, across, kAfterTop + kAfterHeight + 18.0);
  return std::move(svg).finish();
}

std::string residual_chart(const View& view) {
  const std::string plot = residual_plot(view);
  if (plot.empty())
    return section("residuals", "say.report.residuals",
                   paragraph("", say("say.report.residuals.none")) + left_out(view));
  const double after = range_of(view.marks, &Mark::after_mm, 0.0);
  return section("residuals", "say.report.residuals",
                 legend() + fmt::format("<div class=\"scroll\">{}</div>\n", plot) +
                     note(view, band_of(view), after) + left_out(view));
}

}  // namespace cellcal::daemon::report
