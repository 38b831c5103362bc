// Control chart of the checks of the calibrations before this one, and the changes of the cell in it.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "calib/result/drift_chart.h"
#include "calib/words/phrase.h"
#include "daemon/report/axes.h"
#include "daemon/report/report.h"

namespace cellcal::daemon::report {
namespace {

using calib::DriftEvent, calib::DriftPoint, svg::Anchor, svg::Svg;

constexpr double kChecksWidth = 940.0, kChecksHeight = 230.0, kChecksLeft = 46.0,
                 kChecksRight = 14.0, kChecksTop = 30.0, kChecksBottom = 30.0;
constexpr double kLowestScale = 1.25, kHighestScale = 20.0, kCheckDot = 2.6;
constexpr double kLatestS = 1e11;
constexpr std::size_t kMostRows = 40;

bool is_dated(double time_s) { return time_s > 0.0 && time_s < kLatestS; }

/// Measured, or not holding for another reason than the tool.
bool is_drawn(const DriftPoint& point) {
  return is_dated(point.check.time_s) && (point.check.left_out == calib::LeftOut::kNo ||
                                          point.check.verdict == calib::CheckVerdict::kDoesNotHold);
}

bool failed(const DriftPoint& point) {
  return point.check.verdict == calib::CheckVerdict::kDoesNotHold;
}

/// Share of the alarm limit; a check that does not hold is never drawn below it.
double share_of(const DriftPoint& point) {
  const double share = std::isfinite(point.share) ? point.share : kHighestScale;
  return std::min(failed(point) ? std::max(1.0, share) : share, kHighestScale);
}

/// In order of time.
std::vector<DriftPoint> drawn_points(const calib::DriftChart& chart) {
  std::vector<DriftPoint> points;
  const auto take = [&points](const std::vector<DriftPoint>& from) {
    std::ranges::copy_if(from, std::back_inserter(points), is_drawn);
  };
  for (const calib::OtherChart& other : chart.others) take(other.points);
  take(chart.points);
  std::ranges::stable_sort(points, {}, [](const DriftPoint& one) { return one.check.time_s; });
  return points;
}

Scale dates_of(const std::vector<DriftPoint>& points, const std::vector<DriftEvent>& events) {
  double from = kLatestS, to = 0.0;
  const auto include = [&](double time_s) {
    from = std::min(from, time_s);
    to = std::max(to, time_s);
  };
  for (const DriftPoint& point : points) include(point.check.time_s);
  for (const DriftEvent& event : events) include(event.time_s);
  if (!(to > from)) to = from + 1.0;
  return {from, to, kChecksLeft, kChecksWidth - kChecksRight};
}

void draw_date_axes(Svg& svg, const View& view, const Scale& across, const Scale& up) {
  svg.text({across.at_from, up.at_to - 15.0}, Anchor::kStart, "panel",
           view.say("say.report.checks.share"));
  for (const double tick : round_ticks(up.from, up.to, 4)) {
    svg.line({across.at_from, up(tick)}, {across.at_to, up(tick)}, tick == 0.0 ? "zero" : "grid");
    svg.text({across.at_from - 6.0, up(tick) + 4.0}, Anchor::kEnd, "tick", significant(tick, 6));
  }
  svg.line({across.at_from, up(1.0)}, {across.at_to, up(1.0)}, "limit");
  constexpr int kDates = 5;
  for (int i = 0; i < kDates; ++i) {
    const double x = std::lerp(across.at_from, across.at_to, i / (kDates - 1.0));
    const Anchor anchor = i == 0            ? Anchor::kStart
                          : i == kDates - 1 ? Anchor::kEnd
                                            : Anchor::kMiddle;
    svg.text({x, kChecksHeight - 8.0}, anchor, "tick",
             calib::date_words(std::lerp(across.from, across.to, i / (kDates - 1.0))));
  }
}

void draw_events(Svg& svg, const Scale& across, const Scale& up,
                 const std::vector<DriftEvent>& events) {
  for (std::size_t i = 0; i < events.size(); ++i) {
    const double x = across(events[i].time_s);
    svg.line({x, up.at_from}, {x, up.at_to}, "certified");
    svg.text({x, up.at_to - 3.0}, Anchor::kMiddle, "label", fmt::format("{}", i + 1));
  }
}

void draw_point(Svg& svg, const View& view, const Scale& across, const Scale& up,
                const DriftPoint& point) {
  const svg::Point at{across(point.check.time_s), up(share_of(point))};
  const std::string title =
      fmt::format("{} {}, {}: {:.0f} %", view.say("say.report.checks.check"), point.check.session,
                  calib::date_words(point.check.time_s), 100.0 * share_of(point));
  if (failed(point))
    svg.cross(at, 1.6 * kCheckDot, "outlier after", title);
  else
    svg.circle(at, kCheckDot, "fit after", title);
}

std::string picture(const View& view, const std::vector<DriftPoint>& points,
                    const std::vector<DriftEvent>& events) {
  double most = kLowestScale;
  for (const DriftPoint& point : points) most = std::max(most, share_of(point));
  const Scale across = dates_of(points, events);
  const Scale up{0.0, most, kChecksHeight - kChecksBottom, kChecksTop};
  Svg svg(kChecksWidth, kChecksHeight, "chart checks",
          view.say({"say.report.checks.picture",
                    {{"checks", points.size()}, {"events", events.size()}}}));
  draw_date_axes(svg, view, across, up);
  draw_events(svg, across, up, events);
  for (const DriftPoint& point : points) draw_point(svg, view, across, up, point);
  return "<div class=\"scroll\">" + std::move(svg).finish() + "</div>\n";
}

std::string table_of(const std::vector<DriftEvent>& events) {
  Table table({"", "", {"", "word wide"}}, "narrow");
  for (std::size_t i = 0; i < events.size(); ++i)
    table.row({std::to_string(i + 1), calib::date_words(events[i].time_s),
               escape(say(phrase(events[i])))});
  return table.html();
}

}  // namespace

std::string check_chart(const View& view) {
  if (!view.input.checks) return "";
  std::vector<DriftEvent> events = view.input.checks->events;
  std::erase_if(events, [](const DriftEvent& event) { return !is_dated(event.time_s); });
  if (events.size() > kMostRows)
    events.erase(events.begin(), events.end() - static_cast<std::ptrdiff_t>(kMostRows));
  const std::vector<DriftPoint> points = drawn_points(*view.input.checks);
  if (points.empty() && events.size() < 2) return "";
  return section("checks", "say.report.checks",
                 (points.empty() ? "" : picture(view, points, events)) + table_of(events) +
                     paragraph("note", say("say.report.checks.note")));
}

}  // namespace cellcal::daemon::report
