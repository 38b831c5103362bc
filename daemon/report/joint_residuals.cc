// Residual by joint angle, one small plot per joint: what is left of a joint's own error shows as a wave or a step.

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "calib/model/units.h"
#include "daemon/report/axes.h"
#include "daemon/report/report.h"

namespace cellcal::daemon::report {
namespace {

using svg::Anchor, svg::Svg;

constexpr double kSmallWidth = 300.0, kSmallHeight = 170.0, kSmallLeft = 46.0, kSmallRight = 8.0,
                 kSmallTop = 24.0, kSmallBottom = 24.0;
constexpr double kDotRadius = 2.2;
constexpr double kLeastSpanDeg = 1.0;

/// Marks of touches with this joint's angle.
struct JointMarks {
  std::vector<const Mark*> marks;
  std::vector<double> at;  ///< deg, or mm of a linear unit
};

JointMarks marks_of(const View& view, std::size_t joint, const calib::JointUnit& unit) {
  JointMarks found;
  for (const Mark& mark : view.marks) {
    if (mark.number > view.input.touches.size() || mark.kind == MarkKind::kOutlier) continue;
    const calib::Touch& touch = view.input.touches[mark.number - 1];
    if (joint >= touch.joint_rad.size() || !std::isfinite(touch.joint_rad[joint])) continue;
    found.marks.push_back(&mark);
    found.at.push_back(touch.joint_rad[joint] * unit.per_si);
  }
  return found;
}

std::string plot(const View& view, const JointMarks& of, const std::string& name,
                 const calib::JointUnit& unit, double most_mm, double least_mm) {
  const auto [low, high] = std::ranges::minmax(of.at);
  const double spare = std::max(high - low, kLeastSpanDeg) * 0.04;
  const Scale across{low - spare, high + spare, kSmallLeft, kSmallWidth - kSmallRight};
  const Scale up{least_mm, most_mm, kSmallHeight - kSmallBottom, kSmallTop};
  Svg svg(kSmallWidth, kSmallHeight, "chart small",
          view.say({"say.report.by_joint.picture", {{"joint", name}}}));
  svg.text({kSmallLeft, kSmallTop - 9.0}, Anchor::kStart, "panel",
           fmt::format("{}, {}", shorten(name, 20), unit_word(unit.name)));
  draw_value_axis(svg, across, up, 4, 6.0);
  for (const double tick : round_ticks(across.from, across.to, 4))
    svg.text({across(tick), kSmallHeight - 8.0}, Anchor::kMiddle, "tick", fixed(tick, 0));
  for (std::size_t i = 0; i < of.marks.size(); ++i) {
    const Mark& mark = *of.marks[i];
    draw_mark(svg, view, mark, {across(of.at[i]), up.clamped(mark.after_mm)}, kDotRadius,
              kDotRadius * 1.4, "after");
  }
  return std::move(svg).finish();
}

}  // namespace

std::vector<std::string> joint_plots(const View& view) {
  double most = 0.0;
  for (const Mark& mark : view.marks)
    if (mark.kind != MarkKind::kOutlier) most = std::max(most, std::abs(mark.after_mm));
  most = round_up(most, 0.1);
  const double least = view.points_only() ? 0.0 : -most;
  std::vector<std::string> plots;
  for (std::size_t j = 0; j < view.result.cell.robot.joints.size(); ++j) {
    const calib::Joint& joint = view.result.cell.robot.joints[j];
    const JointMarks of = marks_of(view, j, unit_of(joint));
    if (!of.marks.empty()) plots.push_back(plot(view, of, joint.name, unit_of(joint), most, least));
  }
  return plots;
}

std::string joint_residuals(const View& view) {
  const std::vector<std::string> plots = joint_plots(view);
  if (plots.empty()) return "";
  return section("by-joint", "say.report.by_joint",
                 fmt::format("<div class=\"small-plots\">{}</div>\n", fmt::join(plots, "")) +
                     paragraph("note", say("say.report.by_joint.note")));
}

}  // namespace cellcal::daemon::report
