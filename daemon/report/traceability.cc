// Conditions, equipment and files of the calibration, as needed to repeat or challenge it.

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/units.h"
#include "daemon/report/plan_picture.h"
#include "daemon/report/report.h"

namespace cellcal::daemon::report {
namespace {

constexpr int kJointDecimals = 5;  // as in the touches CSV
constexpr int kMassDecimals = 3;
constexpr int kGravityDecimals = 3;
constexpr int kSpeedDecimals = 2;

// `html` is already escaped; empty values are named as missing.
std::string pair(std::string_view name, const std::string& html) {
  return fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", name,
                     html.empty() ? std::string("<em>not stated</em>") : html);
}

std::string vector_mm(const Eigen::Vector3d& v) {
  return fmt::format("{}, {}, {}", mm(v.x()), mm(v.y()), mm(v.z()));
}

std::string session_rows(const View& view) {
  const ReportInput& input = view.input;
  return pair("Session", escape(input.session_id)) + pair("Started", escape(input.started)) +
         pair("Finished", escape(input.finished)) + pair("Software", escape(input.software)) +
         pair("Method", method_words(view.result.method)) +
         (level_words(view).empty() ? std::string() : pair("Model level", level_words(view)));
}

std::string robot_rows(const View& view) {
  const calib::Cell& cell = view.result.cell;
  std::string robot = escape(cell.robot.name);
  if (!cell.robot.source.empty()) {
    robot += fmt::format("<br><small>{}</small>", escape(cell.robot.source));
  }
  const Eigen::Vector3d& g = cell.robot.gravity_m_s2;
  return pair("Cell", escape(view.input.cell_name)) + pair("Robot", robot) +
         pair("Joints", fmt::format("{}", cell.robot.joints.size())) +
         pair("Gravity in base, m/s&sup2;",
              fmt::format("{}, {}, {}", fixed(g.x(), kGravityDecimals),
                          fixed(g.y(), kGravityDecimals), fixed(g.z(), kGravityDecimals)));
}

std::string one_tool(const calib::Tool& tool) {
  return (tool.id.empty() ? std::string() : pair("Tool", escape(tool.id))) +
         pair("TCP from flange, mm", vector_mm(tool.tcp.translation())) +
         pair("TCP &sigma;, mm", tool.tcp_sigma_m.isZero() ? std::string("taken as known")
                                                           : vector_mm(tool.tcp_sigma_m)) +
         pair("Tool mass, kg", fixed(tool.mass_kg, kMassDecimals)) +
         pair("Tool length, mm", mm(tool.length_m, 1)) +
         pair("Tip radius, mm", mm(tool.tip_radius_m));
}

std::string tool_rows(const View& view) {
  const calib::Cell& cell = view.result.cell;
  std::string rows = one_tool(cell.tool);
  for (const calib::Tool& tool : cell.other_tools) rows += one_tool(tool);
  return rows + pair("Touch &sigma;, mm", mm(cell.touch_sigma_m)) +
         pair("Radius offset &sigma;, mm", mm(cell.radius_offset_sigma_m));
}

std::string artefact_rows(const View& view) {
  std::string rows;
  for (const calib::Target& target : view.result.cell.targets) {
    std::string words(kind_word(target.kind));
    if (target.kind == calib::TargetKind::kSphere) {
      words += fmt::format(", diameter {}&nbsp;mm, &sigma;&nbsp;{}&nbsp;mm", mm(target.diameter_m),
                           mm(target.diameter_sigma_m));
    }
    rows += pair(escape(target.id), words);
  }
  for (const calib::CertifiedLength& length : view.result.cell.lengths) {
    rows += pair(fmt::format("{} to {}", escape(length.from), escape(length.to)),
                 fmt::format("certified {}&nbsp;mm, &sigma;&nbsp;{}&nbsp;mm", mm(length.length_m),
                             mm(length.sigma_m)));
  }
  return rows;
}

std::string pairs_table(std::string_view heading, const std::string& rows) {
  if (rows.empty()) return {};
  return fmt::format(
      "<div class=\"block\"><h3>{}</h3>\n<table class=\"pairs\">\n{}</table></div>\n", heading,
      rows);
}

std::string files_table(const View& view) {
  if (view.result.inputs.empty()) {
    return "<p class=\"warn\">The calibration lists no input files, so it cannot be traced to "
           "them.</p>\n";
  }
  std::string rows;
  for (const calib::InputFile& file : view.result.inputs) {
    rows += fmt::format(
        "<tr><th scope=\"row\">{}</th><td class=\"word\">{}</td><td class=\"word\">"
        "<code class=\"hash\">{}</code></td></tr>\n",
        escape(file.role), escape(file.name), escape(file.sha256));
  }
  return fmt::format(
      "<h3>Input files</h3>\n<div class=\"scroll\"><table class=\"numbers files\">\n<thead><tr>"
      "<th scope=\"col\">role</th><th scope=\"col\" class=\"word\">file</th>"
      "<th scope=\"col\" class=\"word\">SHA-256</th></tr></thead>\n<tbody>\n{}</tbody>\n</table>"
      "</div>\n",
      rows);
}

std::string notes_list(const View& view) {
  std::string items;
  for (const std::string& note : view.input.notes) {
    items += fmt::format("<li>{}</li>\n", escape(note));
  }
  return items.empty() ? items : fmt::format("<h3>Notes</h3>\n<ul>\n{}</ul>\n", items);
}

/// Values that few sessions have; they get a column where present.
struct Extra {
  const char* head;
  bool (*has)(const calib::Touch&);
  std::string (*words)(const calib::Touch&);
};
constexpr Extra kExtras[] = {
    {"tool", [](const calib::Touch& t) { return !t.tool.empty(); },
     [](const calib::Touch& t) { return escape(t.tool); }},
    {"load", [](const calib::Touch& t) { return !t.load.empty(); },
     [](const calib::Touch& t) { return escape(t.load); }},
    {"&deg;C", [](const calib::Touch& t) { return t.temperature_c.has_value(); },
     [](const calib::Touch& t) { return ascii_fixed(*t.temperature_c, 1); }}};

/// Columns present in any touch.
std::vector<const Extra*> extras_of(const std::vector<calib::Touch>& touches) {
  std::vector<const Extra*> used;
  for (const Extra& extra : kExtras)
    if (std::any_of(touches.begin(), touches.end(), extra.has)) used.push_back(&extra);
  return used;
}

std::string touch_row(const calib::Touch& touch, std::size_t number,
                      const std::vector<calib::Joint>& joints,
                      const std::vector<const Extra*>& extras) {
  std::string more;
  for (const Extra* extra : extras)
    more += fmt::format("<td class=\"word\">{}</td>",
                        extra->has(touch) ? extra->words(touch) : std::string());
  std::string cells;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const double per_si = calib::unit_of(joints[i]).per_si;
    cells +=
        fmt::format("<td>{}</td>", i < touch.joint_rad.size()
                                       ? ascii_fixed(touch.joint_rad[i] * per_si, kJointDecimals)
                                       : std::string("\xE2\x80\x93"));
  }
  const bool known = touch.readings > 0;
  return fmt::format(
      "<tr><th scope=\"row\">{}</th>{}<td class=\"word\">{}</td><td class=\"word\">{}</td>"
      "<td>{}</td><td>{}</td><td>{}</td><td>{}</td>{}<td class=\"word\">{}</td></tr>\n",
      number, cells, escape(touch.target), to_string(touch.set),
      touch.sigma_m > 0.0 ? ascii_fixed(touch.sigma_m * calib::kMmPerM, kMmDecimals)
                          : std::string(),
      known ? fmt::format("{}", touch.readings) : std::string(),
      touch.readings > 1 ? ascii_fixed(touch.spread_m * calib::kMmPerM, kMmDecimals)
                         : std::string(),
      touch.speed_m_s > 0.0 ? ascii_fixed(touch.speed_m_s * calib::kMmPerM, kSpeedDecimals)
                            : std::string(),
      more, escape(touch.time));
}

}  // namespace

std::string traceability(const View& view) {
  const std::string body = "<div class=\"columns\">\n" +
                           pairs_table("Session", session_rows(view)) +
                           pairs_table("Robot and cell", robot_rows(view)) +
                           pairs_table("Tool and touch", tool_rows(view)) +
                           pairs_table("Targets and certified lengths", artefact_rows(view)) +
                           "</div>\n" + notes_list(view) + files_table(view) + raw_touches(view);
  return section("traceability", "Conditions and traceability", body);
}

std::string raw_touches(const View& view) {
  const auto& touches = view.input.touches;
  if (touches.empty()) return "<p class=\"warn\">The touches were not given.</p>\n";
  const auto& joints = view.result.cell.robot.joints;
  std::string head;
  for (const calib::Joint& joint : joints) {
    head += fmt::format("<th scope=\"col\">{}, {}</th>", escape(joint.name),
                        calib::unit_of(joint).name);
  }
  const auto extras = extras_of(touches);
  std::string more;
  for (const Extra* extra : extras)
    more += fmt::format("<th scope=\"col\" class=\"word\">{}</th>", extra->head);
  std::string rows;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    rows += touch_row(touches[i], i + 1, joints, extras);
  }
  return fmt::format(
      "<details>\n<summary>Raw touches ({0}); open before printing to have them on "
      "paper</summary>\n<div class=\"scroll\"><table class=\"numbers raw\">\n<thead><tr>"
      "<th scope=\"col\">no.</th>{1}<th scope=\"col\" class=\"word\">target</th>"
      "<th scope=\"col\" class=\"word\">set</th><th scope=\"col\">&sigma;, mm</th>"
      "<th scope=\"col\">readings</th><th scope=\"col\">spread, mm</th>"
      "<th scope=\"col\">speed, mm/s</th>{3}<th scope=\"col\" "
      "class=\"word\">time</th></tr></thead>\n"
      "<tbody>\n{2}</tbody>\n</table></div>\n</details>\n<p class=\"on-paper\">Raw touches ({0}): in the "
      "electronic file of this report.</p>\n",
      touches.size(), head, rows, more);
}

}  // namespace cellcal::daemon::report
