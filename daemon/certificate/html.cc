// Sections of the certificate, in their order.

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <map>
#include <stdexcept>
#include <utility>

#include "calib/result/finding_phrase.h"
#include "daemon/certificate/certificate.h"
#include "daemon/files/child.h"
#include "daemon/report/plan_picture.h"
#include "daemon/report/say.h"

namespace cellcal::daemon::certificate {

namespace {

using report::escape, report::say;

// No scripts and no external content, even if an escaping fault remained.
constexpr std::string_view kContentPolicy =
    "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'";
constexpr const char* kNone = "\xE2\x80\x93";
constexpr const char* kMissing = "say.report.not_stated";

constexpr std::array<std::pair<std::string_view, std::string_view>, 8> kConstants{
    {{"k", "2"},
     {"percent", "95"},
     {"guidance", "ILAC-G8:09/2019"},
     {"standard", "14253-1"},
     {"sum", "256"},
     {"guard_band", "0"},
     {"performance", "9283"},
     {"cycles", "30"}}};

std::string cell(const std::string& html, bool is_number = false) {
  return fmt::format("<td{}>{}</td>", is_number ? " class=\"n\"" : "", html);
}

std::string pair(const char* name, const std::string& html) {
  return fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", say(name), html);
}

std::string pairs(const std::string& rows) {
  return "<table class=\"pairs\">\n" + rows + "</table>\n";
}

std::string heading(const char* id) { return "<h2>" + say(id) + "</h2>\n"; }

/// Local time, followed by UTC.
std::string moment(const Entry& local, const Entry& utc) {
  return utc.stated() ? fmt::format("{} &middot; {}", shown(local), shown(utc)) : shown(utc);
}

/// In English the entry's own text is shown.
bool is_translated() { return report::language() != calib::Language(); }

/// As that phrase in another language; empty: as it is.
std::string shown_as(Entry entry, const calib::Phrase& phrase) {
  if (is_translated() && entry.stated() && !phrase.empty()) entry.text = say(phrase);
  return shown(entry);
}

/// A name of the files ("sphere", "fast search") in the document's language, where it has an entry.
std::string named(const char* ids, const Entry& entry) {
  const std::string id = ids + entry.text;
  return shown_as(entry, calib::sentence_of(id) ? id : "");
}

std::string object(const CertificateData& d) {
  return heading("say.certificate.object") + "<div class=\"columns\">" +
         pairs(pair("say.certificate.robot", shown(d.robot)) +
               pair("say.certificate.robot_serial", shown(d.robot_serial)) +
               pair("say.certificate.controller_serial", shown(d.controller_serial)) +
               (d.tool.stated() ? pair("say.certificate.tool", shown(d.tool)) : "") +
               pair("say.certificate.tip_radius", with_unit(d.tip_radius, kMissing)) +
               pair("say.certificate.sensor", shown(d.sensor)) +
               pair("say.certificate.sensor_serial", shown(d.sensor_serial)) +
               pair("say.certificate.site", shown(d.site)) +
               pair("say.certificate.cell", shown(d.cell))) +
         "</div>\n";
}

std::string figures(const CertificateData& d) {
  std::string rows;
  for (const Figure& one : d.figures)
    rows += fmt::format("<tr><th scope=\"row\">{}</th>{}{}</tr>\n", say(one.what),
                        cell(shown(one.found, kNone), true), cell(shown(one.left, kNone), true));
  std::string found =
      d.found_by ? say({"say.certificate.found_by",
                        {{"calibration",
                          shown_as(*d.found_by, calib::calibration_phrase(d.found_by->text))}}})
                 : say("say.certificate.found_by.nominal");
  if (d.earlier_not_comparable) found += say("say.certificate.found_by.not_comparable");
  return fmt::format(
             "<table class=\"whole\">\n<thead><tr><th scope=\"col\">mm</th>"
             "<th scope=\"col\" class=\"n\">{}</th><th scope=\"col\" class=\"n\">{}</th></tr></thead>\n"
             "<tbody>\n{}</tbody></table>\n",
             say("say.certificate.as_found"), say("say.certificate.as_left"), rows) +
         report::paragraph("note",
                           say({"say.certificate.figures.note",
                                {{"found", found},
                                 {"poses", d.poses.stated() ? say({"say.certificate.over_poses",
                                                                   {{"n", shown(d.poses)}}})
                                                            : std::string()},
                                 {"k", constant("k")},
                                 {"percent", constant("percent")}}}));
}

std::string result(const CertificateData& d) {
  return heading("say.certificate.result") +
         fmt::format(
             "<div class=\"result\"><p class=\"verdict\">{}</p>\n<p>{}</p></div>\n",
             say(d.workspace ? "say.certificate.accepted.workspace"
                             : "say.certificate.accepted.near"),
             say(d.workspace ? "say.certificate.holds.workspace" : "say.certificate.holds.near")) +
         figures(d);
}

std::string decision(const CertificateData& d) {
  const Decision& rule = d.decision;
  if (!rule.stated)
    return heading("say.certificate.rule") +
           report::paragraph("", say("say.certificate.rule.not_recorded"));
  return heading("say.certificate.rule") +
         report::paragraph("",
                           say({"say.certificate.rule.simple",
                                {{"guidance", constant("guidance")},
                                 {"guard_band", constant("guard_band")},
                                 {"standard", constant("standard")},
                                 {"predicted", with_unit(rule.predicted)},
                                 {"required", with_unit(rule.required)},
                                 {"by", say(rule.by_cell_file ? "say.certificate.rule.by_cell_file"
                                                              : "say.certificate.rule.by_default")},
                                 {"most_of_nominal", with_unit(rule.most_of_nominal)},
                                 {"nominal", with_unit(rule.nominal)},
                                 {"of_nominal", with_unit(rule.of_nominal)}}}));
}

std::string table(const std::string& head, const std::string& rows, std::string_view css = "") {
  return fmt::format("<table{}>\n<thead><tr>{}</tr></thead>\n<tbody>\n{}</tbody></table>\n",
                     css.empty() ? "" : fmt::format(" class=\"{}\"", css), head, rows);
}

/// What holds the scale, with the certificates of its lengths.
std::string traceability(const CertificateData& d) {
  if (d.scale == calib::ScaleBy::kReadings) return say("say.certificate.traceability.instrument");
  if (d.scale != calib::ScaleBy::kLengths)
    return say(d.lengths.empty() ? "say.certificate.no_length"
                                 : "say.certificate.traceability.none");
  std::map<std::string, std::string> certificates;
  for (const Length& one : d.lengths)
    if (one.certificate.stated() && !one.is_check)
      certificates.try_emplace(one.certificate.text, shown(one.certificate));
  calib::Phrase all;
  for (const auto& [text, html] : certificates) all = joined("say.join.comma", all, html);
  return all.empty() ? say("say.certificate.traceability.held")
                     : say({"say.certificate.traceability", {{"certificates", all}}});
}

/// Head of a column by its id.
struct Head {
  Head(const char* its_id, bool number = false)
      : id(its_id), is_number(number) {}  // NOLINT: text is a head
  const char* id;
  bool is_number;
};
Head number(const char* id) { return {id, true}; }

std::string heads(std::initializer_list<Head> columns) {
  std::string cells;
  for (const Head& one : columns)
    cells += fmt::format("<th{}>{}</th>", one.is_number ? " class=\"n\"" : "", say(one.id));
  return cells;
}

std::string between(const Entry& from, const Entry& to) {
  return say({"say.report.lengths.between", {{"from", shown(from)}, {"to", shown(to)}}});
}

std::string certified_lengths(const CertificateData& d) {
  if (d.lengths.empty()) return {};
  std::string rows;
  for (const Length& one : d.lengths)
    rows += "<tr>" + cell(between(one.from, one.to)) + cell(shown(one.length), true) +
            cell(shown(one.expanded), true) + cell(shown(one.certificate)) + cell(shown(one.date)) +
            "</tr>\n";
  return table(
             heads({"say.certificate.col.length", number("mm"), number("say.certificate.col.u_mm"),
                    "say.certificate.col.certificate", "say.certificate.col.date"}),
             rows) +
         report::paragraph("note", say({"say.certificate.lengths.u", {{"k", constant("k")}}}));
}

std::string artefacts(const CertificateData& d) {
  std::string rows;
  for (const Artefact& one : d.artefacts)
    rows += "<tr>" + cell(shown(one.id)) + cell(named("say.report.kind.", one.kind)) +
            cell(shown(one.diameter, kNone), true) + cell(shown(one.expanded, kNone), true) +
            cell(shown(one.serial)) + cell(shown(one.certificate)) + cell(shown(one.date)) +
            "</tr>\n";
  return heading("say.certificate.artefacts") +
         table(heads({"say.certificate.col.artefact", "say.report.col.kind",
                      number("say.certificate.col.diameter"), number("say.certificate.col.u_mm"),
                      "say.certificate.col.serial", "say.certificate.col.certificate",
                      "say.certificate.col.date"}),
               rows) +
         certified_lengths(d);
}

std::string length_checks(const CertificateData& d) {
  if (d.length_checks.empty()) return "";
  std::string rows;
  for (const LengthCheck& one : d.length_checks)
    rows += "<tr>" + cell(between(one.from, one.to)) + cell(shown(one.certified), true) +
            cell(shown(one.certified_expanded), true) + cell(shown(one.measured), true) +
            cell(shown(one.expanded), true) + cell(shown(one.deviation), true) +
            cell(shown(one.deviation_expanded), true) + "</tr>\n";
  return "<h3>" + say("say.certificate.scale") + "</h3>\n" +
         table(heads({"say.certificate.col.not_fitted", number("say.certificate.col.certified"),
                      number("say.certificate.col.u_mm"), number("say.certificate.col.measured"),
                      number("say.certificate.col.u_mm"), number("say.certificate.col.deviation"),
                      number("say.certificate.col.u_mm")}),
               rows) +
         report::paragraph("note", say({"say.certificate.scale.note", {{"k", constant("k")}}}));
}

std::string budget(const CertificateData& d) {
  if (d.budget.empty()) return "";
  std::string rows;
  for (const BudgetLine& one : d.budget)
    rows += "<tr>" + cell(say(one.source)) + cell(with_unit(one.sigma, kNone), true) +
            cell(say("say.certificate.normal")) + cell(with_unit(one.sensitivity, kNone), true) +
            cell(shown(one.contribution), true) + "</tr>\n";
  const auto total = [](const std::string& name, const Entry& value) {
    return "<tr>" + cell(name) + cell("") + cell("") + cell("") + cell(shown(value), true) +
           "</tr>\n";
  };
  rows += total(say("say.certificate.combined"), d.standard) +
          total(say({"say.certificate.expanded", {{"k", constant("k")}}}), d.expanded);
  return heading("say.certificate.budget") +
         table(heads({"say.certificate.col.source", number("say.certificate.col.standard"),
                      "say.certificate.col.distribution", number("say.certificate.col.sensitivity"),
                      number("say.certificate.col.contribution")}),
               rows) +
         report::paragraph("note", say("say.certificate.budget.note"));
}

std::string list(const std::vector<Said>& entries) {
  std::string items;
  for (const Said& one : entries) items += "<li>" + shown_as(one.entry, one.phrase) + "</li>\n";
  return "<ul>\n" + items + "</ul>\n";
}

std::string frame(const CertificateData& d) {
  return heading("say.certificate.frame") +
         report::paragraph("", say("say.certificate.frame.note")) +
         (d.directions.empty() ? report::paragraph("", say("say.certificate.frame.none"))
                               : list(d.directions));
}

std::string breaks(const CertificateData& d) {
  if (d.dropped.stated())
    return say({"say.certificate.breaks.dropped", {{"at", shown(d.dropped)}}});
  if (!d.changes_recorded) return say("say.certificate.not_recorded");
  if (d.breaks.empty()) return say("say.certificate.breaks.none");
  std::string words;
  for (const Break& one : d.breaks)
    words += fmt::format(
        "<div>{}</div>",
        one.resumed ? say({"say.certificate.breaks.resumed", {{"at", moment(one.local, one.utc)}}})
                    : say({"say.certificate.breaks.interrupted",
                           {{"at", moment(one.local, one.utc)},
                            {"phase", named("say.phase.", one.phase)},
                            {"event", named("say.happened.", one.event)}}}));
  return words;
}

std::string conditions(const CertificateData& d) {
  const std::string temperature =
      d.lowest_c.stated()
          ? say({"say.certificate.temperature.range",
                 {{"low", with_unit(d.lowest_c)}, {"high", with_unit(d.highest_c)}}})
          : say("say.certificate.not_recorded");
  return heading("say.certificate.conditions") +
         pairs(pair("say.report.session", shown(d.session)) +
               pair("say.certificate.operator", shown(d.operator_name)) +
               pair("say.certificate.begun", moment(d.began_local, d.began)) +
               pair("say.certificate.ended", moment(d.ended_local, d.ended)) +
               pair("say.certificate.breaks", breaks(d)) +
               pair("say.certificate.temperature", temperature) +
               pair("say.certificate.touches", shown(d.touches)) +
               pair("say.certificate.software.session", shown(d.software)) +
               pair("say.certificate.software.issue", shown(d.issuing_software)));
}

/// On the first page.
std::string issue(const CertificateData& d) {
  const auto field = [](const char* id) { return "<td><span>" + say(id) + "</span></td>"; };
  return "<div class=\"signatures\">" +
         pairs(pair("say.certificate.issued", moment(d.issued_local, d.issued)) +
               (d.issued_by.stated() ? pair("say.certificate.issued_by", shown(d.issued_by)) : "") +
               pair("say.certificate.traceability.head", traceability(d))) +
         "<table class=\"sign\"><tr>" + field("say.certificate.issued_by") +
         field("say.report.reviewed_by") + field("say.report.date") + "</tr></table></div>\n";
}

std::string sums(const CertificateData& d) {
  std::string rows;
  for (const File& one : d.files)
    rows += "<tr>" + cell(named("say.report.files.role.", one.role)) + "<td class=\"word\">" +
            shown(one.name) + "</td>" + "<td class=\"hash\">" + shown(one.sha256) + "</td></tr>\n";
  const auto row = [](const char* role, const char* what, const Entry& sum) {
    return "<tr><td>" + say(role) + "</td><td>" + say(what) + "</td><td class=\"hash\">" +
           shown(sum) + "</td></tr>\n";
  };
  rows +=
      row("say.certificate.rows", "say.certificate.rows.what", d.rows_sha256) +
      row("say.certificate.calibration", "say.certificate.calibration.what", d.calibration_sha256);
  return "<h2 class=\"appendix\">" + say("say.certificate.inputs") + "</h2>\n" +
         table(heads({"say.report.files.col.role", "say.report.files.col.file"}) + "<th>SHA-" +
                   constant("sum") + "</th>",
               rows);
}

std::string parameters(const CertificateData& d) {
  std::string rows;
  for (const Parameter& one : d.parameters)
    rows += "<tr>" + cell(shown(one.name)) + cell(shown(one.nominal, kNone), true) +
            cell(shown(one.correction, kNone), true) + cell(shown(one.expanded, kNone), true) +
            cell(one.nominal.unit.empty() ? std::string() : unit(one.nominal)) +
            cell(named("say.report.decided.", one.decided_by)) + "</tr>\n";
  return heading("say.certificate.parameters") +
         report::paragraph("note", say({"say.certificate.fitted",
                                        {{"method", shown_as(d.method, d.method_said)}}})) +
         table(heads({"say.report.col.parameter", number("say.report.col.nominal"),
                      number("say.report.col.correction"), number("U"), "say.report.col.unit",
                      "say.report.col.decided_by"}),
               rows, "small") +
         report::paragraph("note", say("say.certificate.parameters.note"));
}

std::string cells(const auto& numbers) {
  std::string all;
  for (const Entry& one : numbers) all += cell(shown(one, kNone), true);
  return all;
}

std::string positioner(const CertificateData& d) {
  if (d.positioner.empty()) return {};
  std::string rows;
  for (const PositionerAxis& one : d.positioner) {
    rows += "<tr>" + cell(shown(one.name)) + cells(one.xyz) + cells(one.along) +
            cells(std::array{one.place, one.direction}) + "</tr>\n";
  }
  return heading("say.report.positioner") +
         table(heads({"say.report.positioner.col.axis", number("x, mm"), number("y, mm"),
                      number("z, mm"), number("say.report.positioner.col.direction_x"), number("y"),
                      number("z"), number("say.report.positioner.col.place"),
                      number("say.report.positioner.col.direction")}),
               rows, "small") +
         report::paragraph("note", say("say.report.positioner.note"));
}

std::string linear_unit(const CertificateData& d) {
  if (!d.linear_unit) return {};
  const LinearUnit& unit = *d.linear_unit;
  const std::string line = "<tr>" + cell(shown(unit.name)) + cells(unit.along) +
                           cells(std::array{unit.direction, unit.scale, unit.scale_u95});
  std::string rows;
  for (const LinearUnit::Row& row : unit.rows) {
    rows += "<tr>" + cell(shown(row.position), true);
    for (std::size_t k = 0; k < row.motion.size(); ++k)
      rows += cell(shown(row.motion[k], kNone), true) + cell(shown(row.u95[k], kNone), true);
    rows += "</tr>\n";
  }
  return heading("say.report.linear_unit") +
         table(heads({"say.report.positioner.col.axis",
                      number("say.report.positioner.col.direction_x"), number("y"), number("z"),
                      number("say.report.positioner.col.direction"),
                      number("say.report.linear_unit.col.scale"), number("U")}),
               line + "</tr>\n", "small") +
         table(heads({number("say.report.linear_unit.col.at"),
                      number("say.report.linear_unit.col.along"), number("U"),
                      number("say.report.linear_unit.col.across"), number("U"),
                      number("say.report.linear_unit.col.above"), number("U"),
                      number("say.report.linear_unit.col.roll"), number("U"),
                      number("say.report.linear_unit.col.pitch"), number("U"),
                      number("say.report.linear_unit.col.yaw"), number("U")}),
               rows, "small") +
         report::paragraph("note", say("say.report.linear_unit.note"));
}

/// As in files: with a decimal point.
std::string raw(const Entry& entry) {
  const report::Speaking plain((calib::Language()));
  return shown(entry, kNone);
}

std::string touches(const CertificateData& d) {
  std::string head = heads({number("say.report.raw.col.number"), "say.certificate.col.artefact",
                            "say.report.raw.col.set"});
  for (const Entry& name : d.joint_names)
    head += fmt::format("<th class=\"n\">{}, {}</th>", shown(name),
                        name.unit == "mm" ? "mm" : say("say.unit.deg"));
  head += heads({number("say.report.raw.col.readings"), number("mm/s"), number("&deg;C"),
                 "say.certificate.col.time"});
  std::string rows;
  for (const TouchRow& one : d.rows) {
    rows += "<tr>" + cell(raw(one.number), true) + cell(shown(one.target)) +
            cell(named("say.report.raw.set.", one.set));
    for (const Entry& joint : one.joints) rows += cell(raw(joint), true);
    rows += cell(raw(one.readings), true) + cell(raw(one.speed), true) +
            cell(raw(one.temperature), true) + cell(raw(one.time)) + "</tr>\n";
  }
  return "<div class=\"wide\">\n" + heading("say.certificate.raw") + table(head, rows, "small") +
         "</div>\n";
}

}  // namespace

std::string shown(const Entry& entry, const char* otherwise) {
  if (!entry.stated()) return say(otherwise);
  return fmt::format("<span data-from=\"{}\">{}</span>", escape(entry.from),
                     escape(entry.value ? report::localised(entry.text) : entry.text));
}

std::string unit(const Entry& entry) {
  return fmt::format("<span data-from=\"unit({})\">{}</span>", escape(entry.from),
                     escape(report::unit_word(entry.unit)));
}

std::string with_unit(const Entry& entry, const char* otherwise) {
  if (!entry.stated()) return say(otherwise);
  return shown(entry) + "&nbsp;" + escape(report::unit_word(entry.unit));
}

std::string_view value_of_constant(std::string_view name) {
  for (const auto& [one, value] : kConstants)
    if (one == name) return value;
  return {};
}

std::string constant(const char* name) {
  return shown({std::string(value_of_constant(name)), std::string("method#") + name});
}

std::string document_name(const calib::Language& language, const std::string& extension) {
  return report::file_name("certificate", language, extension);
}

std::string to_html(const CertificateData& d, const calib::Language& language) {
  const report::Speaking speaking(language);
  const std::string title = say("say.certificate.title");
  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"{}\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"{}\">\n"
      "<title>{}</title>\n<style>\n{}{}</style>\n</head>\n<body>\n<main>\n<h1>{}</h1>\n{}",
      language.code(), escape(kContentPolicy), title, style_sheet(),
      fmt::format("@page {{ @bottom-right {{ content: {}; }} }}\n", say("say.certificate.page_of")),
      title,
      report::paragraph("number", say({"say.certificate.number", {{"number", shown(d.number)}}})));
  if (d.emulated.stated())
    html += report::paragraph(
        "emulated", say({"say.certificate.emulated",
                         {{"cell", shown_as(d.emulated, "say.certificate.emulated_cell")}}}));
  html += issue(d) + object(d) + result(d) + decision(d) + artefacts(d) + length_checks(d) +
          budget(d) + pose_sheet_html(d.pose_sheet) + frame(d) + conditions(d);
  html += heading("say.certificate.remarks") + list(d.remarks);
  html += sums(d) + parameters(d) + positioner(d) + linear_unit(d) + touches(d);
  return html + "</main>\n</body>\n</html>\n";
}

// One style for screen and print (A4, black on white).

const char* style_sheet() {
  return R"css(
@page {
  size: A4; margin: 16mm 16mm 20mm 16mm;
  @bottom-left { content: string(number); font: 8pt "DejaVu Sans", sans-serif; color: #555; }
  @bottom-right { font: 8pt "DejaVu Sans", sans-serif; color: #555; }
}
@page wide { size: A4 landscape; }
* { box-sizing: border-box; }
body { margin: 0; background: #fff; color: #111; overflow-wrap: break-word;
  font: 9.5pt/1.4 "DejaVu Sans", "Liberation Sans", Arial, sans-serif; }
@media screen { body { max-width: 210mm; margin: 0 auto; padding: 16mm; } }
h1 { font-size: 19pt; margin: 0 0 1mm; font-weight: 600; }
h2 { font-size: 11.5pt; margin: 6mm 0 2mm; padding-top: 2mm; border-top: 0.3mm solid #999;
  break-after: avoid; }
h3 { font-size: 9.5pt; margin: 3mm 0 1mm; break-after: avoid; }
p, li { margin: 0 0 1.5mm; orphans: 3; widows: 3; }
ol, ul { margin: 0; padding-left: 6mm; }
.emulated { border: 1mm solid #b00; padding: 2mm 4mm; font-weight: bold; }
.number { string-set: number content(); font-size: 11pt; margin-bottom: 4mm; }
.result { border: 0.5mm solid #111; padding: 3mm 4mm; margin: 3mm 0; break-inside: avoid; }
.result p { margin: 0; }
.result .verdict { font-size: 12.5pt; font-weight: 600; }
table { border-collapse: collapse; width: 100%; margin: 0 0 2mm; }
thead { display: table-header-group; }
tr { break-inside: avoid; }
th, td { text-align: left; vertical-align: top; padding: 0.7mm 2mm 0.7mm 0; font-weight: normal;
  border-bottom: 0.15mm solid #ccc; }
thead th { font-weight: 600; border-bottom: 0.3mm solid #555; vertical-align: bottom; }
.columns { columns: 2; column-gap: 6mm; }
.pairs th { width: 42mm; color: #444; }
td.n, th.n { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
.whole { break-inside: avoid; }
.note { font-size: 8.5pt; color: #333; }
.hash { font: 7.5pt "DejaVu Sans Mono", monospace; overflow-wrap: anywhere; }
.small, .small td, .small th { font-size: 7.5pt; padding-top: 0.4mm; padding-bottom: 0.4mm; }
td.word { overflow-wrap: anywhere; }
.wide { page: wide; break-before: page; }
.signatures { break-inside: avoid; }
.sign td { border: 0; padding-top: 7mm; width: 33%; }
.sign span { display: block; border-top: 0.3mm solid #111; padding-top: 1mm; }
.appendix { break-before: page; }
)css";
}

void write_pdf(const std::filesystem::path& html, const std::filesystem::path& pdf,
               std::chrono::milliseconds limit) {
  std::filesystem::path part = pdf;
  part += ".part";
  const ChildEnd end = run_child(
      {.words = {"weasyprint", "--encoding=utf-8", std::filesystem::absolute(html).string(),
                 std::filesystem::absolute(part).string()},
       .limit = limit});
  if (end.error == ENOENT)
    throw std::runtime_error(
        fmt::format("{}: not written: the program weasyprint is missing. Install the package "
                    "'weasyprint', or give --no-pdf",
                    pdf.string()));
  std::error_code code;
  if (end.status == 0 && std::filesystem::exists(part, code)) {
    std::filesystem::rename(part, pdf);
    return;
  }
  std::filesystem::remove(part, code);
  throw std::runtime_error(fmt::format(
      "{}: not written: weasyprint {}. Run 'weasyprint {} {}' to see why", pdf.string(),
      end.why == ChildEnd::Why::kTooLong
          ? fmt::format("was ended after {} s", std::chrono::duration<double>(limit).count())
          : "failed",
      html.string(), pdf.string()));
}

}  // namespace cellcal::daemon::certificate
