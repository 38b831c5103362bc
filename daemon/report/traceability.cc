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
std::string pair(const std::string& name, const std::string& html) {
  return fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", name,
                     html.empty() ? "<em>" + say("say.report.not_stated") + "</em>" : html);
}

/// "1.0, 2.0, 3.0"; "1,0; 2,0; 3,0".
std::string triple(const std::string& x, const std::string& y, const std::string& z) {
  return say({"say.report.triple", {{"x", x}, {"y", y}, {"z", z}}});
}

std::string vector_mm(const Eigen::Vector3d& v) {
  return triple(mm(v.x()), mm(v.y()), mm(v.z()));
}

std::string session_rows(const View& view) {
  const ReportInput& input = view.input;
  return pair(say("say.report.session"), escape(input.session_id)) + pair(say("say.report.started"), escape(input.started)) +
         pair(say("say.report.finished"), escape(input.finished)) + pair(say("say.report.software"), escape(input.software)) +
         pair(say("say.report.trace.method"), method_words(view.result.method)) +
         (level_words(view).empty() ? std::string() : pair(say("say.report.trace.level"), level_words(view)));
}

std::string robot_rows(const View& view) {
  const calib::Cell& cell = view.result.cell;
  std::string robot = escape(cell.robot.name);
  if (!cell.robot.source.empty()) {
    robot += fmt::format("<br><small>{}</small>", escape(cell.robot.source));
  }
  const Eigen::Vector3d& g = cell.robot.gravity_m_s2;
  return pair(say("say.report.cell"), escape(view.input.cell_name)) + pair(say("say.report.robot"), robot) +
         pair(say("say.report.trace.joints"), fmt::format("{}", cell.robot.joints.size())) +
         pair(say("say.report.trace.gravity"),
              triple(fixed(g.x(), kGravityDecimals), fixed(g.y(), kGravityDecimals),
                     fixed(g.z(), kGravityDecimals)));
}

std::string one_tool(const calib::Tool& tool) {
  return (tool.id.empty() ? std::string() : pair(say("say.report.trace.tool"), escape(tool.id))) +
         pair(say("say.report.trace.tcp"), vector_mm(tool.tcp.translation())) +
         pair(say("say.report.trace.tcp_sigma"), tool.tcp_sigma_m.isZero()
                                                      ? say("say.report.trace.taken_as_known")
                                                      : vector_mm(tool.tcp_sigma_m)) +
         pair(say("say.report.trace.tool_mass"), fixed(tool.mass_kg, kMassDecimals)) +
         pair(say("say.report.trace.tool_length"), mm(tool.length_m, 1)) +
         pair(say("say.report.trace.tip_radius"), mm(tool.tip_radius_m));
}

std::string tool_rows(const View& view) {
  const calib::Cell& cell = view.result.cell;
  std::string rows = one_tool(cell.tool);
  for (const calib::Tool& tool : cell.other_tools) rows += one_tool(tool);
  return rows + pair(say("say.report.trace.touch_sigma"), mm(cell.touch_sigma_m)) +
         pair(say("say.report.trace.radius_offset_sigma"), mm(cell.radius_offset_sigma_m));
}

std::string artefact_rows(const View& view) {
  std::string rows;
  for (const calib::Target& target : view.result.cell.targets) {
    std::string words = kind_word(target.kind);
    if (target.kind == calib::TargetKind::kSphere) {
      words += say({"say.report.trace.diameter",
                    {{"mm", mm(target.diameter_m)}, {"sigma", mm(target.diameter_sigma_m)}}});
    }
    rows += pair(escape(target.id), words);
  }
  for (const calib::CertifiedLength& length : view.result.cell.lengths) {
    rows += pair(say({"say.report.lengths.between",
                      {{"from", escape(length.from)}, {"to", escape(length.to)}}}),
                 say({"say.report.trace.certified",
                      {{"mm", mm(length.length_m)}, {"sigma", mm(length.sigma_m)}}}));
  }
  return rows;
}

std::string pairs_table(const char* heading, const std::string& rows) {
  if (rows.empty()) return {};
  return fmt::format(
      "<div class=\"block\"><h3>{}</h3>\n<table class=\"pairs\">\n{}</table></div>\n", say(heading),
      rows);
}

/// Role of an input file; those that have no entry stay as they are.
std::string role_words(const std::string& role) {
  const std::string id = "say.report.files.role." + role;
  return calib::sentence_of(id) ? say(id) : role;
}

std::string files_table(const View& view) {
  if (view.result.inputs.empty()) {
    return paragraph("warn", say("say.report.files.none"));
  }
  std::string rows;
  for (const calib::InputFile& file : view.result.inputs) {
    rows += fmt::format(
        "<tr><th scope=\"row\">{}</th><td class=\"word\">{}</td><td class=\"word\">"
        "<code class=\"hash\">{}</code></td></tr>\n",
        escape(role_words(file.role)), escape(file.name), escape(file.sha256));
  }
  return fmt::format(
      "<h3>{}</h3>\n<div class=\"scroll\"><table class=\"numbers files\">\n{}<tbody>\n{}</tbody>\n</table>"
      "</div>\n",
      say("say.report.files"),
      table_head({{say("say.report.files.col.role")},
                  {say("say.report.files.col.file"), true},
                  {"SHA-256", true}}),
      rows);
}

std::string notes_list(const View& view) {
  std::string items;
  for (const calib::Phrase& note : view.input.notes)
    items += fmt::format("<li>{}</li>\n", escape(say(note)));
  return items.empty() ? items
                       : fmt::format("<h3>{}</h3>\n<ul>\n{}</ul>\n", say("say.report.notes"), items);
}

/// Values that few sessions have; they get a column where present.
struct Extra {
  const char* head;
  bool (*has)(const calib::Touch&);
  std::string (*words)(const calib::Touch&);
};
constexpr Extra kExtras[] = {
    {"say.report.raw.col.tool", [](const calib::Touch& t) { return !t.tool.empty(); },
     [](const calib::Touch& t) { return escape(t.tool); }},
    {"say.report.raw.col.load", [](const calib::Touch& t) { return !t.load.empty(); },
     [](const calib::Touch& t) { return escape(t.load); }},
    {"say.report.raw.col.temperature", [](const calib::Touch& t) { return t.temperature_c.has_value(); },
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
      number, cells, escape(touch.target), say(std::string("say.report.raw.set.") + to_string(touch.set)),
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
                           pairs_table("say.report.session", session_rows(view)) +
                           pairs_table("say.report.trace.robot_and_cell", robot_rows(view)) +
                           pairs_table("say.report.trace.tool_and_touch", tool_rows(view)) +
                           pairs_table("say.report.trace.artefacts", artefact_rows(view)) +
                           "</div>\n" + notes_list(view) + files_table(view) + raw_touches(view);
  return section("traceability", "say.report.traceability", body);
}

std::string raw_touches(const View& view) {
  const auto& touches = view.input.touches;
  if (touches.empty()) return paragraph("warn", say("say.report.raw.none"));
  const auto& joints = view.result.cell.robot.joints;
  std::string head;
  for (const calib::Joint& joint : joints) {
    head += fmt::format("<th scope=\"col\">{}, {}</th>", escape(joint.name),
                        unit_word(calib::unit_of(joint).name));
  }
  const auto extras = extras_of(touches);
  std::string more;
  for (const Extra* extra : extras)
    more += fmt::format("<th scope=\"col\" class=\"word\">{}</th>", say(extra->head));
  std::string rows;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    rows += touch_row(touches[i], i + 1, joints, extras);
  }
  return fmt::format(
      "<details>\n<summary>{}</summary>\n<div class=\"scroll\"><table class=\"numbers raw\">\n"
      "<thead><tr><th scope=\"col\">{}</th>{}<th scope=\"col\" class=\"word\">{}</th>"
      "<th scope=\"col\" class=\"word\">{}</th><th scope=\"col\">&sigma;, mm</th>"
      "<th scope=\"col\">{}</th><th scope=\"col\">{}</th><th scope=\"col\">{}</th>{}"
      "<th scope=\"col\" class=\"word\">{}</th></tr></thead>\n"
      "<tbody>\n{}</tbody>\n</table></div>\n</details>\n{}",
      say({"say.report.raw", {{"n", touches.size()}}}), say("say.report.raw.col.number"), head,
      say("say.report.col.target"), say("say.report.raw.col.set"), say("say.report.raw.col.readings"),
      say("say.report.raw.col.spread"), say("say.report.raw.col.speed"), more,
      say("say.report.raw.col.time"), rows,
      paragraph("on-paper", say({"say.report.raw.on_paper", {{"n", touches.size()}}})));
}

}  // namespace cellcal::daemon::report
