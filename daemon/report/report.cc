#include "daemon/report/report.h"

#include <fmt/format.h>

#include <string_view>

#include "daemon/report/plan_picture.h"
#include "daemon/report/view.h"

namespace cellcal::daemon {

namespace {

// No scripts and no external content, even if an escaping fault remained.
constexpr std::string_view kContentPolicy =
    "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'";

std::string masthead(const ReportInput& input) {
  const std::string& robot = input.calibration.cell.robot.name;
  std::string facts;
  const auto add = [&facts](std::string_view name, const std::string& value) {
    if (value.empty()) return;
    facts += fmt::format("<span>{} <b>{}</b></span>\n", name, report::escape(value));
  };
  add("Cell", input.cell_name);
  add("Robot", robot);
  add(input.finished.empty() ? "Started" : "Finished",
      report::readable_time(input.finished.empty() ? input.started : input.finished));
  add("Session", input.session_id);
  return fmt::format(
      "<header>\n<h1>Calibration report</h1>\n<p class=\"facts\">{}</p>\n</header>\n", facts);
}

std::string page_title(const ReportInput& input) {
  std::string title = "Calibration report";
  if (!input.cell_name.empty()) title += " - " + input.cell_name;
  if (!input.finished.empty()) title += " - " + input.finished;
  return report::escape(title);
}

std::string_view signatures() {
  return "<div class=\"signatures\"><p>Reviewed by</p><p>Date</p><p>Signature</p></div>\n";
}

}  // namespace

std::string html_report(const ReportInput& input) {
  const report::View view(input);
  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"{}\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta name=\"color-scheme\" content=\"light "
      "dark\">\n<title>{}</title>\n<style>\n{}</style>\n"
      "</head>\n<body>\n<main>\n",
      report::escape(kContentPolicy), page_title(input),
      std::string(report::style_sheet()) + report::plan_style());
  html += masthead(input);
  html += report::verdict_banner(view);
  html += report::summary(view);
  html += report::figures_table(view);
  html += report::meaning(view);
  html += report::residual_chart(view);
  html += report::residual_histogram(view);
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

}  // namespace cellcal::daemon
