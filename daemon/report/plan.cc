// What was planned before the first touch, beside what was made of it.

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <string>

#include "daemon/report/drawing/plan_picture.h"
#include "daemon/report/drawing/text.h"
#include "daemon/report/sections.h"

namespace cellcal::daemon::report {

namespace {

std::size_t count(const calib::Plan& plan, calib::TouchSet set, std::string_view target = {}) {
  return static_cast<std::size_t>(std::count_if(
      plan.touches.begin(), plan.touches.end(), [&](const calib::PlannedTouch& touch) {
        return touch.set == set && (target.empty() || touch.target == target);
      }));
}

std::string summary_of(const View& view, const calib::Plan& plan) {
  std::string words = fmt::format("<p>{} for the fit and {} held out as a check were planned",
                                  counted(count(plan, calib::TouchSet::kFit), "touch", "touches"),
                                  count(plan, calib::TouchSet::kCheck));
  if (view.input.planned_s > 0.0)
    words += fmt::format(", {}&nbsp;min of robot time at its own axis speeds",
                         fixed(view.input.planned_s / 60.0, 1));
  words += ".";
  if (is_known(plan.predicted_mean_m)) {
    words += fmt::format(
        " Predicted before the first touch, from tolerances and geometry: mean position error {}",
        escape(mm_words(plan.predicted_mean_m)));
    if (is_known(plan.predicted_u95_m))
      words += fmt::format(" and 95&nbsp;% bound {}", escape(mm_words(plan.predicted_u95_m)));
    words +=
        " over the planned region. The result is the predicted error at the top of this report.";
  }
  return words + "</p>\n";
}

std::string table_of(const View& view, const calib::Plan& plan) {
  std::string rows;
  for (const calib::Target& target : view.result.cell.targets) {
    const std::size_t fit = count(plan, calib::TouchSet::kFit, target.id);
    const std::size_t check = count(plan, calib::TouchSet::kCheck, target.id);
    if (fit + check == 0) continue;
    const auto made =
        std::count_if(view.input.touches.begin(), view.input.touches.end(),
                      [&](const calib::Touch& touch) { return touch.target == target.id; });
    rows += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td></tr>\n",
                        escape(target.id), fit, check, made);
  }
  return "<div class=\"scroll\"><table class=\"numbers narrow\">\n<thead><tr><th "
         "scope=\"col\">Target</th><th scope=\"col\">planned for the fit</th><th "
         "scope=\"col\">planned as a check</th><th "
         "scope=\"col\">made</th></tr></thead>\n<tbody>\n" +
         rows + "</tbody></table></div>\n";
}

std::string picture_of(const View& view, const calib::Plan& plan) {
  try {
    const PlanViews views = plan_views(view.result.cell, plan);
    return fmt::format("<div class=\"pair\">{}{}</div>\n<p class=\"note\">{}</p>\n", views.above,
                       views.side, escape(views.legend));
  } catch (const std::exception& error) {
    return fmt::format("<p class=\"warn\">The plan cannot be drawn: {}.</p>\n",
                       escape(error.what()));
  }
}

}  // namespace

std::string plan(const View& view) {
  if (!view.input.plan) return {};
  const calib::Plan& made = *view.input.plan;
  return section("plan", "The plan",
                 summary_of(view, made) + table_of(view, made) + picture_of(view, made));
}

}  // namespace cellcal::daemon::report
