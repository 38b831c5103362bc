#include "daemon/report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "calib/files/json.h"
#include "calib/model/enum_table.h"
#include "calib/model/units.h"

namespace cellcal::daemon {

namespace {

std::string masthead(const ReportInput& input) {
  const std::string& robot = input.calibration.cell.robot.name;
  std::string facts;
  const auto add = [&facts](std::string_view name, const std::string& value) {
    if (value.empty()) return;
    facts += fmt::format("<span>{} <b>{}</b></span>\n", name, report::escape(value));
  };
  add(report::say("say.report.cell"), input.cell_name);
  add(report::say("say.report.robot"), robot);
  add(report::say(input.finished.empty() ? "say.report.started" : "say.report.finished"),
      report::readable_time(input.finished.empty() ? input.started : input.finished));
  add(report::say("say.report.session"), input.session_id);
  return fmt::format("<header>\n<h1>{}</h1>\n<p class=\"facts\">{}</p>\n</header>\n",
                     report::say("say.report.title"), facts);
}

std::string page_title(const ReportInput& input) {
  std::string title = report::say("say.report.title");
  if (!input.cell_name.empty()) title += " - " + input.cell_name;
  if (!input.finished.empty()) title += " - " + input.finished;
  return report::escape(title);
}

std::string signatures() {
  return fmt::format("<div class=\"signatures\"><p>{}</p><p>{}</p><p>{}</p></div>\n",
                     report::say("say.report.reviewed_by"), report::say("say.report.date"),
                     report::say("say.report.signature"));
}

}  // namespace

std::string report_name(const calib::Language& language) {
  return report::file_name("report", language, "html");
}

std::string plots_name(const calib::Language& language) {
  return report::file_name("plots", language, "json");
}

std::string plots_json(std::int64_t session, const ReportPlots& plots) {
  return calib::write_json({{"session", session},
                            {"before_after", plots.before_after},
                            {"by_joint", plots.by_joint},
                            {"error_map", plots.error_map}});
}

std::string html_report(const ReportInput& input) {
  const report::View view(input);
  std::string html = report::begin_document(
      page_title(input), report::kStyleSheet,
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta name=\"color-scheme\" content=\"light dark\">\n");
  html += masthead(input);
  html += report::verdict_banner(view);
  html += report::summary(view);
  html += report::figures_table(view);
  html += report::meaning(view);
  html += report::residual_chart(view);
  html += report::joint_residuals(view);
  html += report::residual_histogram(view);
  html += report::error_map(view);
  html += report::check_chart(view);
  html += report::cell_picture(view);
  html += report::plan(view);
  html += report::sphere_maps(view);
  html += report::targets_table(view);
  html += report::model(view);
  html += report::parameters_table(view);
  html += report::unidentifiable(view);
  html += report::outliers(view);
  html += report::correlations(view);
  html += report::traceability(view);
  html += signatures();
  html += "</main>\n</body>\n</html>\n";
  return html;
}

ReportPlots report_plots(const ReportInput& input) {
  const report::View view(input);
  return {report::residual_plot(view), report::joint_plots(view), report::error_map_plot(view)};
}

}  // namespace cellcal::daemon

namespace cellcal::daemon::report {
namespace {

constexpr std::size_t kTitleLength = 40;

template <class Target>
const Target* with_id(const std::vector<Target>& targets, std::string_view id) {
  const auto at = std::ranges::find(targets, id, &Target::id);
  return at == targets.end() ? nullptr : &*at;
}

}  // namespace

bool is_usable_mm(double value) { return std::isfinite(value) && std::abs(value) < kUsableMm; }

bool is_known(double predicted_m) { return std::isfinite(predicted_m) && predicted_m > 0.0; }

View::View(const ReportInput& report_input)
    : input(report_input), speaking(input.language), result(report_input.calibration) {
  std::set<std::size_t> named;
  for (const calib::Outlier& outlier : result.outliers) named.insert(outlier.touch);
  std::set<std::size_t> set_aside = named;
  marks.reserve(result.residuals.size());
  for (const calib::TouchResidual& residual : result.residuals) {
    Mark mark;
    mark.number = residual.touch + 1;
    if (residual.touch < input.touches.size()) {
      const calib::Touch& touch = input.touches[residual.touch];
      mark.held_out = touch.set == calib::TouchSet::kCheck;
      mark.target = touch.target;
      mark.in_3d = is_point(touch.target);
    } else {
      ++unknown;
    }
    if (residual.outlier || named.contains(residual.touch)) {
      mark.kind = MarkKind::kOutlier;
      set_aside.insert(residual.touch);
    } else {
      mark.kind = mark.held_out ? MarkKind::kCheck : MarkKind::kFit;
    }
    mark.before_mm = residual.before_m * calib::kMmPerM;
    mark.after_mm = residual.after_m * calib::kMmPerM;
    mark.whitened = residual.whitened;
    if (residual.direction.allFinite()) mark.direction = residual.direction;
    if (is_usable_mm(mark.before_mm) && is_usable_mm(mark.after_mm) &&
        std::isfinite(mark.whitened)) {
      marks.push_back(std::move(mark));
    } else {
      ++unusable;
    }
  }
  outliers = set_aside.size();
  for (std::size_t i = 0; i < input.touches.size(); ++i) {
    if (set_aside.contains(i)) continue;
    ++(input.touches[i].set == calib::TouchSet::kCheck ? check : fit);
  }
}

const calib::Target* View::cell_target(std::string_view id) const {
  return with_id(result.cell.targets, id);
}

const calib::TargetResult* View::target_result(std::string_view id) const {
  return with_id(result.targets, id);
}

bool View::is_point(std::string_view id) const {
  const calib::Target* target = cell_target(id);
  return target &&
         (target->kind == calib::TargetKind::kPoint || target->kind == calib::TargetKind::kTracker);
}

bool View::is_round(std::string_view id) const {
  const calib::Target* target = cell_target(id);
  return !target || target->kind == calib::TargetKind::kSphere ||
         target->kind == calib::TargetKind::kWire;
}

bool View::points_only() const {
  return !marks.empty() && std::ranges::all_of(marks, &Mark::in_3d);
}

bool View::any_point() const { return std::ranges::any_of(marks, &Mark::in_3d); }

std::size_t View::touched_lengths() const {
  for (const calib::Finding& one : result.verdict.findings)
    if (const auto* lengths = calib::find(one.evidence, "lengths");
        lengths != nullptr && one.kind == calib::FindingKind::kScaleByLengths)
      return static_cast<std::size_t>(lengths->value);
  std::set<std::pair<std::string, std::string>> ends;  // each length once
  for (const calib::CertifiedLength& length : result.cell.lengths)
    if (!length.is_check && target_result(length.from) && target_result(length.to))
      ends.insert(std::minmax(length.from, length.to));
  return ends.size();
}

std::string name_of(const View& view, const calib::ParameterResult& parameter) {
  return calib::parameter_name(view.result.cell, parameter.key);
}

std::string kind_word(calib::TargetKind kind) {
  return say(std::string("say.report.kind.") + to_string(kind));
}

std::string target_words(const View& view) {
  const auto& targets = view.result.targets;
  std::set<std::string> kinds;
  for (const calib::TargetResult& target : targets) {
    const calib::Target* in_cell = view.cell_target(target.id);
    kinds.insert(in_cell ? to_string(in_cell->kind) : "target");
  }
  const std::string kind = kinds.size() == 1 ? *kinds.begin() : "target";
  return counted(targets.size(), "say.report.on." + kind + ".");
}

std::string mark_title(const View& view, const Mark& mark) {
  const char* kind = mark.held_out ? "say.report.mark.held_out" : "say.report.mark.fitted";
  if (mark.kind == MarkKind::kOutlier) kind = "say.report.mark.outlier";
  return view.say({mark.target.empty() ? "say.report.mark" : "say.report.mark.on",
                   {{"touch", mark.number},
                    {"target", shorten(mark.target, kTitleLength)},
                    {"kind", kind},
                    {"before", fixed(mark.before_mm, kMmDecimals)},
                    {"after", fixed(mark.after_mm, kMmDecimals)}}});
}

void draw_shape(svg::Svg& svg, MarkKind kind, svg::Point at, double size, double larger,
                std::string_view look, std::string_view title) {
  const std::string classes = fmt::format("{} {}", own_name(kind), look);
  if (kind == MarkKind::kFit) return svg.circle(at, size, classes, title);
  if (kind == MarkKind::kCheck) return svg.diamond(at, larger, classes, title);
  svg.cross(at, larger, classes, title);
}

void draw_mark(svg::Svg& svg, const View& view, const Mark& mark, svg::Point at, double size,
               double larger, std::string_view look) {
  draw_shape(svg, mark.kind, at, size, larger, look, mark_title(view, mark));
}

std::string section(std::string_view id, const char* heading, std::string_view body) {
  return fmt::format("<section id=\"{}\">\n<h2>{}</h2>\n{}</section>\n", id, say(heading), body);
}

}  // namespace cellcal::daemon::report
