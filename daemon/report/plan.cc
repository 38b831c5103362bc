// The plan before the first touch, compared with the executed touches.

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "calib/export/svg.h"
#include "calib/files/files.h"
#include "calib/model/units.h"
#include "calib/plan/duration.h"
#include "daemon/report/plan_picture.h"
#include "daemon/report/report.h"

namespace cellcal::daemon::report {

namespace {

std::size_t count(const calib::Plan& plan, calib::TouchSet set, std::string_view target = {}) {
  return static_cast<std::size_t>(std::count_if(
      plan.touches.begin(), plan.touches.end(), [&](const calib::PlannedTouch& touch) {
        return touch.set == set && (target.empty() || touch.target == target);
      }));
}

std::string summary_of(const View& view, const calib::Plan& plan) {
  const std::string touches = counted(count(plan, calib::TouchSet::kFit), "say.report.touches.");
  const std::size_t check = count(plan, calib::TouchSet::kCheck);
  std::string words =
      view.input.planned_s > 0.0
          ? say({"say.report.plan.summary.time",
                 {{"touches", touches},
                  {"check", check},
                  {"minutes", fixed(view.input.planned_s / 60.0, 1)}}})
          : say({"say.report.plan.summary", {{"touches", touches}, {"check", check}}});
  if (is_known(plan.predicted_mean_m))
    words += say(
        {is_known(plan.predicted_u95_m) ? "say.report.plan.predicted.bound"
                                        : "say.report.plan.predicted",
         {{"mean", mm_words(plan.predicted_mean_m)}, {"bound", mm_words(plan.predicted_u95_m)}}});
  return paragraph("", words);
}

std::string table_of(const View& view, const calib::Plan& plan) {
  Table table({"say.report.col.target", "say.report.plan.col.fit", "say.report.plan.col.check",
               "say.report.plan.col.made"},
              "narrow");
  for (const calib::Target& target : view.result.cell.targets) {
    const std::size_t fit = count(plan, calib::TouchSet::kFit, target.id);
    const std::size_t check = count(plan, calib::TouchSet::kCheck, target.id);
    if (fit + check == 0) continue;
    const auto made = std::ranges::count(view.input.touches, target.id, &calib::Touch::target);
    table.row(
        {escape(target.id), std::to_string(fit), std::to_string(check), std::to_string(made)});
  }
  return table.html();
}

std::string picture_of(const View& view, const calib::Plan& plan) {
  // One picture shows one setting.
  if (!view.result.cell.robot.positioner.empty()) return {};
  try {
    const PlanViews views = plan_views(view.result.cell, plan);
    return fmt::format("<div class=\"pair\">{}{}</div>\n", views.above, views.side) +
           paragraph("note", escape(views.legend));
  } catch (const std::exception& error) {
    return paragraph("warn", say({"say.report.plan.not_drawn", {{"why", escape(error.what())}}}));
  }
}

}  // namespace

std::string plan(const View& view) {
  if (!view.input.plan) return {};
  const calib::Plan& made = *view.input.plan;
  return section("plan", "say.report.plan",
                 summary_of(view, made) + table_of(view, made) + picture_of(view, made));
}

}  // namespace cellcal::daemon::report

namespace cellcal::daemon {

// Drawing of a plan as a separate document: the drawing rules of the page's style sheet with its light
// colours inserted, since not every SVG viewer supports CSS variables.

namespace {

using report::escape;

constexpr double kViewWidth = 600.0, kViewHeight = 561.0;  // aspect ratio of the views
constexpr double kTop = 44.0, kGap = 20.0, kEdge = 14.0;
constexpr double kLine = 17.0;         // line pitch of the legend
constexpr std::size_t kLetters = 170;  // per line of the legend

/// Variables of the first block (light theme) by name.
std::map<std::string, std::string, std::less<>> light_colours(std::string_view style) {
  std::map<std::string, std::string, std::less<>> colours;
  std::string_view block = style.substr(0, style.find('}'));
  for (std::size_t at = block.find("--"); at != std::string_view::npos; at = block.find("--", at)) {
    const std::size_t colon = block.find(':', at), end = block.find(';', colon);
    if (end == std::string_view::npos) break;
    std::string_view value = block.substr(colon + 1, end - colon - 1);
    value.remove_prefix(std::min(value.find_first_not_of(' '), value.size()));
    colours.emplace(block.substr(at, colon - at), value);
    at = end;
  }
  return colours;
}

/// Its rules that begin with "svg ", with variables replaced.
std::string rules_of(std::string_view style,
                     const std::map<std::string, std::string, std::less<>>& colours) {
  std::string rules;
  bool inside = false;
  while (!style.empty()) {
    const std::size_t end = std::min(style.find('\n'), style.size() - 1) + 1;
    const std::string_view line = style.substr(0, end);
    inside = inside || line.starts_with("svg ");
    if (inside) rules += line;
    inside = inside && line.find('}') == std::string_view::npos;
    style.remove_prefix(end);
  }
  constexpr std::string_view kVariable = "var(";
  for (std::size_t at = rules.find(kVariable); at != std::string::npos;
       at = rules.find(kVariable, at)) {
    const std::size_t end = rules.find(')', at);
    const auto colour = colours.find(
        std::string_view(rules).substr(at + kVariable.size(), end - at - kVariable.size()));
    rules.replace(at, end + 1 - at, colour == colours.end() ? "black" : colour->second);
  }
  return rules;
}

std::string placed(const std::string& view, double x) {
  constexpr std::string_view kBegin = "<svg ";
  return fmt::format("<svg x=\"{:.0f}\" y=\"{:.0f}\" width=\"{:.0f}\" height=\"{:.0f}\" {}", x,
                     kTop, kViewWidth, kViewHeight, view.substr(kBegin.size()));
}

std::string heading(const calib::Cell& cell, const calib::Plan& plan) {
  const std::size_t checks = report::count(plan, calib::TouchSet::kCheck);
  std::string words = report::say(
      {"say.report.plan.heading",
       {{"robot", cell.robot.name},
        {"touches", report::counted(plan.touches.size() - checks, "say.report.touches.")},
        {"check", checks},
        {"minutes", calib::duration_s(plan, cell.robot, {}) / 60.0}}});
  if (plan.predicted_mean_m > 0.0)
    words += report::say(
        {"say.report.plan.heading.mean", {{"mean", report::mm_words(plan.predicted_mean_m)}}});
  if (plan.predicted_u95_m > 0.0)
    words += report::say(
        {"say.report.plan.heading.bound", {{"bound", report::mm_words(plan.predicted_u95_m)}}});
  return words;
}

}  // namespace

std::string plan_svg(const calib::Cell& cell, const calib::Plan& plan) {
  const report::PlanViews views = report::plan_views(cell, plan);
  std::string legend;
  double y = kTop + kViewHeight + kGap;
  for (std::string_view rest = views.legend; !rest.empty();) {
    std::size_t end = rest.size();
    if (end > kLetters) end = rest.rfind(' ', kLetters) + 1;
    legend += fmt::format("<text class=\"tick\" x=\"{:.0f}\" y=\"{:.0f}\">{}</text>\n", kEdge, y,
                          escape(rest.substr(0, end)));
    rest.remove_prefix(end);
    y += kLine;
  }
  const double width = 2.0 * kEdge + 2.0 * kViewWidth + kGap, height = y;
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "viewBox=\"0 0 {0:.0f} {1:.0f}\" font-family=\"Noto Sans, Liberation Sans, Arial, "
      "sans-serif\">\n<title>{2}</title>\n<style>\n{3}</style>\n"
      "<rect width=\"{0:.0f}\" height=\"{1:.0f}\" fill=\"white\"/>\n"
      "<text class=\"tick\" x=\"{4:.0f}\" y=\"26\">{2}</text>\n{5}{6}{7}</svg>\n",
      width, height, escape(heading(cell, plan)),
      rules_of(report::kStyleSheet, light_colours(report::kStyleSheet)), kEdge,
      placed(views.above, kEdge), placed(views.side, kEdge + kViewWidth + kGap), legend);
}

}  // namespace cellcal::daemon

namespace cellcal::daemon::report {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;
using svg::Anchor, svg::Point;

constexpr double kPictureHeight = 360.0;
constexpr double kMarginMm = 150.0;
constexpr std::size_t kPictureLabelLength = 14;

/// At 0.
std::vector<PlanScene::Axle> axles_of(const View& view) {
  constexpr double kHalfMm = 300.0;
  std::vector<PlanScene::Axle> axes;
  for (const calib::PositionerLine& line : view.result.positioner) {
    const Vector3d middle = line.point_m * calib::kMmPerM;
    if (middle.allFinite() && middle.cwiseAbs().maxCoeff() < kUsableMm)
      axes.push_back(
          {line.axis, middle - kHalfMm * line.direction, middle + kHalfMm * line.direction});
  }
  return axes;
}

// A tracker is outside the cell.
bool is_tracker(const View& view, const calib::TargetResult& target) {
  const calib::Target* in_cell = view.cell_target(target.id);
  return in_cell && in_cell->kind == calib::TargetKind::kTracker;
}

std::vector<PlanScene::Ball> balls_of(const View& view) {
  std::vector<PlanScene::Ball> balls;
  for (const calib::TargetResult& target : view.result.targets) {
    if (is_tracker(view, target)) continue;
    const Vector3d centre = place_in_base(view, target) * calib::kMmPerM;
    const double radius = target.effective_radius_m * calib::kMmPerM;
    if (!is_usable_mm(centre.x()) || !is_usable_mm(centre.y()) || !is_usable_mm(centre.z())) {
      continue;
    }
    balls.push_back({target.id, centre, is_usable_mm(radius) ? std::max(radius, 0.0) : 0.0});
  }
  return balls;
}

class CellPanel : public PicturePanel {
 public:
  CellPanel(const PlanScene& scene, const std::vector<calib::CertifiedLength>& lengths, int upward,
            std::string_view heading)
      : PicturePanel(kPictureHeight, "chart cell", 0, upward, heading) {
    fit(scene);
    draw_heading();
    for (const calib::CertifiedLength& length : lengths) {
      const auto from = std::ranges::find(scene.balls, length.from, &PlanScene::Ball::id);
      const auto to = std::ranges::find(scene.balls, length.to, &PlanScene::Ball::id);
      if (from != scene.balls.end() && to != scene.balls.end())
        svg_.line(at(from->centre), at(to->centre), "certified");
    }
    draw_base();
    for (const PlanScene::Axle& axle : scene.axles) {
      svg_.line(at(axle.a), at(axle.b), "axis");
      labels_.keep_free(at(axle.b), 1.0, 1.0);
      svg_.text(labels_.beside(at(axle.b), 0.0, axle.id.size()), Anchor::kStart, "label",
                shorten(axle.id, kPictureLabelLength));
    }
    for (const PlanScene::Ball& ball : scene.balls) {
      svg_.circle(at(ball.centre), radius(ball), "ball", ball.id);
      keep_free(at(ball.centre), radius(ball));
    }
    for (const PlanScene::Ball& ball : scene.balls)
      draw_label(ball, radius(ball), ball.id, kPictureLabelLength);
  }

 private:
  void fit(const PlanScene& scene) {
    Vector2d least = Vector2d::Constant(-kMarginMm), most = Vector2d::Constant(kMarginMm);
    const auto hold = [&](const Vector3d& mm, double around) {
      least = least.cwiseMin((seen(mm).array() - around).matrix());
      most = most.cwiseMax((seen(mm).array() + around).matrix());
    };
    for (const PlanScene::Ball& ball : scene.balls) hold(ball.centre, ball.radius + kMarginMm);
    for (const PlanScene::Axle& axle : scene.axles)
      for (const Vector3d& end : {axle.a, axle.b}) hold(end, 0.0);
    draw_grid(0.5 * (least + most), (inner() / (most - least).array()).minCoeff());
  }

  void draw_base() {
    const Point origin{x_(0.0), y_(0.0)};
    constexpr double kArrow = 30.0;
    svg_.line(origin, {origin.x + kArrow, origin.y}, "axis");
    svg_.line(origin, {origin.x, origin.y - kArrow}, "axis");
    svg_.rectangle({origin.x - 5.0, origin.y - 5.0}, 10.0, 10.0, "base");
    svg_.text({origin.x + kArrow + 4.0, origin.y + 4.0}, Anchor::kStart, "label", "x");
    svg_.text({origin.x, origin.y - kArrow - 4.0}, Anchor::kMiddle, "label",
              std::string(1, "xyz"[upward_]));
    svg_.text({origin.x, origin.y + 20.0}, Anchor::kMiddle, "label", say("say.report.view.base"));
    labels_.keep_free({origin.x - 18.0, origin.y - kArrow - 14.0}, kArrow + 32.0, kArrow + 36.0);
  }
};

}  // namespace

std::string cell_picture(const View& view) {
  PlanScene scene;
  scene.balls = balls_of(view);
  if (scene.balls.empty()) return {};
  scene.axles = axles_of(view);
  scene.z_is_up = z_is_up(view.result.cell.robot);
  const auto& lengths = view.result.cell.lengths;
  std::string body = fmt::format("<div class=\"pair\">{}{}</div>\n",
                                 CellPanel(scene, lengths, 1, scene.heading(1)).finish(),
                                 CellPanel(scene, lengths, 2, scene.heading(2)).finish());
  body +=
      paragraph("note", say("say.report.cell.note") +
                            (lengths.empty() ? std::string() : say("say.report.cell.dashed")) +
                            (scene.axles.empty() ? std::string() : say("say.report.cell.axes")));
  const auto trackers = static_cast<std::size_t>(
      std::count_if(view.result.targets.begin(), view.result.targets.end(),
                    [&](const calib::TargetResult& target) { return is_tracker(view, target); }));
  const std::size_t left_out = view.result.targets.size() - trackers - scene.balls.size();
  if (left_out > 0) {
    body += paragraph("warn", counted(left_out, "say.report.cell.left_out."));
  }
  return section("cell", "say.report.cell.heading", body);
}

}  // namespace cellcal::daemon::report
