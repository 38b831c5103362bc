// Conditions, equipment and files of the calibration, as needed to repeat or challenge it.

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/units.h"
#include "daemon/report/report.h"

namespace cellcal::daemon::report {
namespace {

constexpr int kJointDecimals = 5;  // as in the touches CSV
constexpr int kMassDecimals = 3;
constexpr int kGravityDecimals = 3;
constexpr int kSpeedDecimals = 2;

// `html` is already escaped; empty values are named as missing.
std::string pair(const calib::Phrase& name, const std::string& html) {
  return pair_row(say(name), html.empty() ? "<em>" + say("say.report.not_stated") + "</em>" : html);
}

/// "1.0, 2.0, 3.0"; "1,0; 2,0; 3,0".
std::string triple(const std::string& x, const std::string& y, const std::string& z) {
  return say({"say.report.triple", {{"x", x}, {"y", y}, {"z", z}}});
}

std::string vector_mm(const Eigen::Vector3d& v) { return triple(mm(v.x()), mm(v.y()), mm(v.z())); }

std::string session_rows(const View& view) {
  const ReportInput& input = view.input;
  return pair("say.report.session", escape(input.session_id)) +
         pair("say.report.started", escape(input.started)) +
         pair("say.report.finished", escape(input.finished)) +
         pair("say.report.software", escape(input.software)) +
         pair("say.report.trace.method", method_words(view.result.method)) +
         (level_words(view).empty() ? "" : pair("say.report.trace.level", level_words(view)));
}

std::string robot_rows(const View& view) {
  const calib::Cell& cell = view.result.cell;
  std::string robot = escape(cell.robot.name);
  if (!cell.robot.source.empty()) {
    robot += fmt::format("<br><small>{}</small>", escape(cell.robot.source));
  }
  const Eigen::Vector3d& g = cell.robot.gravity_m_s2;
  return pair("say.report.cell", escape(view.input.cell_name)) + pair("say.report.robot", robot) +
         pair("say.report.trace.joints", fmt::format("{}", cell.robot.joints.size())) +
         pair("say.report.trace.gravity",
              triple(fixed(g.x(), kGravityDecimals), fixed(g.y(), kGravityDecimals),
                     fixed(g.z(), kGravityDecimals)));
}

std::string one_tool(const calib::Tool& tool) {
  return (tool.id.empty() ? "" : pair("say.report.trace.tool", escape(tool.id))) +
         pair("say.report.trace.tcp", vector_mm(tool.tcp.translation())) +
         pair("say.report.trace.tcp_sigma", tool.tcp_sigma_m.isZero()
                                                ? say("say.report.trace.taken_as_known")
                                                : vector_mm(tool.tcp_sigma_m)) +
         pair("say.report.trace.tool_mass", fixed(tool.mass_kg, kMassDecimals)) +
         pair("say.report.trace.tool_length", mm(tool.length_m, 1)) +
         pair("say.report.trace.tip_radius", mm(tool.tip_radius_m));
}

std::string tool_rows(const View& view) {
  const calib::Cell& cell = view.result.cell;
  std::string rows = one_tool(cell.tool);
  for (const calib::Tool& tool : cell.other_tools) rows += one_tool(tool);
  return rows + pair("say.report.trace.touch_sigma", mm(cell.touch_sigma_m)) +
         pair("say.report.trace.radius_offset_sigma", mm(cell.radius_offset_sigma_m));
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
    rows += pair(
        {"say.report.lengths.between", {{"from", escape(length.from)}, {"to", escape(length.to)}}},
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

std::string files_table(const View& view) {
  if (view.result.inputs.empty()) {
    return paragraph("warn", say("say.report.files.none"));
  }
  Table table(
      {"say.report.files.col.role", {"say.report.files.col.file", "word"}, {"SHA-256", "word"}},
      "files");
  for (const calib::InputFile& file : view.result.inputs)
    table.row({escape(say_if("say.report.files.role.", file.role, file.role)), escape(file.name),
               fmt::format("<code class=\"hash\">{}</code>", escape(file.sha256))});
  return fmt::format("<h3>{}</h3>\n", say("say.report.files")) + table.html();
}

std::string notes_list(const View& view) {
  std::string items;
  for (const calib::Phrase& note : view.input.notes)
    items += fmt::format("<li>{}</li>\n", escape(say(note)));
  return items.empty()
             ? items
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
    {"say.report.raw.col.temperature",
     [](const calib::Touch& t) { return t.temperature_c.has_value(); },
     [](const calib::Touch& t) { return ascii_fixed(*t.temperature_c, 1); }}};

/// Columns present in any touch.
std::vector<const Extra*> extras_of(const std::vector<calib::Touch>& touches) {
  std::vector<const Extra*> used;
  for (const Extra& extra : kExtras)
    if (std::any_of(touches.begin(), touches.end(), extra.has)) used.push_back(&extra);
  return used;
}

/// [mm]; empty where it is not `known`.
std::string raw_mm(bool known, double metres, int decimals) {
  return known ? ascii_fixed(metres * calib::kMmPerM, decimals) : "";
}

std::vector<std::string> touch_cells(const calib::Touch& touch, std::size_t number,
                                     const std::vector<calib::Joint>& joints,
                                     const std::vector<const Extra*>& extras) {
  std::vector<std::string> cells = {std::to_string(number)};
  for (std::size_t i = 0; i < joints.size(); ++i)
    cells.push_back(
        i < touch.joint_rad.size()
            ? ascii_fixed(touch.joint_rad[i] * calib::unit_of(joints[i]).per_si, kJointDecimals)
            : kDash);
  cells.insert(cells.end(), {escape(touch.target),
                             say(std::string("say.report.raw.set.") + to_string(touch.set)),
                             raw_mm(touch.sigma_m > 0.0, touch.sigma_m, kMmDecimals),
                             touch.readings > 0 ? std::to_string(touch.readings) : "",
                             raw_mm(touch.readings > 1, touch.spread_m, kMmDecimals),
                             raw_mm(touch.speed_m_s > 0.0, touch.speed_m_s, kSpeedDecimals)});
  for (const Extra* extra : extras) cells.push_back(extra->has(touch) ? extra->words(touch) : "");
  cells.push_back(escape(touch.time));
  return cells;
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
  const auto extras = extras_of(touches);
  std::vector<Column> columns = {"say.report.raw.col.number"};
  for (const calib::Joint& joint : joints)
    columns.emplace_back(
        (escape(joint.name) + ", " + unit_word(calib::unit_of(joint).name)).c_str());
  columns.insert(columns.end(), {{"say.report.col.target", "word"},
                                 {"say.report.raw.col.set", "word"},
                                 "&sigma;, mm",
                                 "say.report.raw.col.readings",
                                 "say.report.raw.col.spread",
                                 "say.report.raw.col.speed"});
  for (const Extra* extra : extras) columns.emplace_back(extra->head, "word");
  columns.emplace_back("say.report.raw.col.time", "word");
  Table table(std::move(columns), "raw");
  for (std::size_t i = 0; i < touches.size(); ++i)
    table.row(touch_cells(touches[i], i + 1, joints, extras));
  return fmt::format(
      "<details>\n<summary>{}</summary>\n{}</details>\n{}",
      say({"say.report.raw", {{"n", touches.size()}}}), table.html(),
      paragraph("on-paper", say({"say.report.raw.on_paper", {{"n", touches.size()}}})));
}

}  // namespace cellcal::daemon::report
