// Sections of the certificate, in their order.

#include "daemon/certificate/html.h"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <map>
#include <stdexcept>
#include <utility>

#include "daemon/certificate/certificate.h"
#include "daemon/files/child.h"
#include "daemon/report/plan_picture.h"

namespace cellcal::daemon::certificate {

namespace {

using report::escape;

// No scripts and no external content, even if an escaping fault remained.
constexpr std::string_view kContentPolicy =
    "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'";
constexpr std::string_view kNone = "\xE2\x80\x93";

constexpr std::array<std::pair<std::string_view, std::string_view>, 8> kConstants{
    {{"k", "2"},
     {"percent", "95"},
     {"guidance", "ILAC-G8:09/2019"},
     {"standard", "14253-1"},
     {"sum", "256"},
     {"guard_band", "0"},
     {"performance", "9283"},
     {"cycles", "30"}}};

std::string cell(const std::string& html, bool number = false) {
  return fmt::format("<td{}>{}</td>", number ? " class=\"n\"" : "", html);
}

std::string pair(std::string_view name, const std::string& html) {
  return fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", name, html);
}

std::string pairs(const std::string& rows) {
  return "<table class=\"pairs\">\n" + rows + "</table>\n";
}

/// Local time, followed by UTC.
std::string moment(const Entry& local, const Entry& utc) {
  return utc.stated() ? fmt::format("{} &middot; {}", shown(local), shown(utc)) : shown(utc);
}

std::string object(const CertificateData& d) {
  return "<h2>Object</h2>\n<div class=\"columns\">" +
         pairs(pair("Robot", shown(d.robot)) + pair("Serial number, robot", shown(d.robot_serial)) +
               pair("Serial number, controller", shown(d.controller_serial)) +
               (d.tool.stated() ? pair("Tool", shown(d.tool)) : "") +
               pair("Tip radius", with_unit(d.tip_radius, "not stated")) +
               pair("Contact sensor", shown(d.sensor)) +
               pair("Serial number, sensor", shown(d.sensor_serial)) + pair("Site", shown(d.site)) +
               pair("Cell file", shown(d.cell))) +
         "</div>\n";
}

std::string figures(const CertificateData& d) {
  std::string rows;
  for (const Figure& one : d.figures)
    rows += fmt::format("<tr><th scope=\"row\">{}</th>{}{}</tr>\n", one.what,
                        cell(shown(one.found, kNone), true), cell(shown(one.left, kNone), true));
  std::string found = d.found_by ? "the calibration of " + shown(*d.found_by)
                                 : std::string("the nominal arm, as drawn");
  if (d.earlier_not_comparable)
    found += " (earlier calibration not used: another nominal arm, tool or version)";
  return fmt::format(
      "<table class=\"whole\">\n<thead><tr><th scope=\"col\">mm</th><th scope=\"col\" class=\"n\">as "
      "found</th><th scope=\"col\" class=\"n\">as left</th></tr></thead>\n<tbody>\n{}</tbody></table>\n"
      "<p class=\"note\">As found: {}. As left: this calibration. Tip against the artefacts: distance from "
      "where contact is expected, the artefacts where they fit best. TCP position error as found: against this calibration, a motion of the "
      "base taken out{}. As left: predicted from the covariance. U: expanded uncertainty, k = {}, of a TCP "
      "position (in three dimensions, mean over the scope). Bound: radius that holds the position error at {} % of "
      "the scope.</p>\n",
      rows, found,
      d.poses.stated() ? fmt::format(", over {} poses", shown(d.poses)) : std::string(),
      constant("k"), constant("percent"));
}

std::string result(const CertificateData& d) {
  return fmt::format(
             "<h2>Result</h2>\n<div class=\"result\"><p class=\"verdict\">Calibration accepted. Scope: {}.</p>\n"
             "<p>{}</p></div>\n",
             d.workspace ? "workspace" : "near the targets",
             d.workspace
                 ? "The figures hold over the workspace in front of the arm."
                 : "The figures hold near the targets only; nothing is claimed elsewhere.") +
         figures(d);
}

std::string decision(const CertificateData& d) {
  const Decision& rule = d.decision;
  if (!rule.stated) return "<h2>Decision rule</h2>\n<p>Not recorded with the result.</p>\n";
  return fmt::format(
      "<h2>Decision rule</h2>\n<p>Simple acceptance ({}, guard band {} mm; compare ISO {}): the calibration is accepted "
      "where the predicted mean TCP position error, {}, is not above {} ({}) and not above {} of the nominal arm&rsquo;s "
      "own, {} (it is {} of it), or of what its tolerances foresee where that is more, and where no other reason of the verdict withholds it. The predicted error is itself "
      "the measure of uncertainty; nothing is added to the limit.</p>\n",
      constant("guidance"), constant("guard_band"), constant("standard"), with_unit(rule.predicted),
      with_unit(rule.required),
      rule.by_cell_file ? "required by the cell file"
                        : "the limit where the cell file requires none",
      with_unit(rule.most_of_nominal), with_unit(rule.nominal), with_unit(rule.of_nominal));
}

std::string table(const std::string& head, const std::string& rows, std::string_view css = "") {
  return fmt::format("<table{}>\n<thead><tr>{}</tr></thead>\n<tbody>\n{}</tbody></table>\n",
                     css.empty() ? "" : fmt::format(" class=\"{}\"", css), head, rows);
}

/// What holds the scale, with the certificates of its lengths.
std::string traceability(const CertificateData& d) {
  if (d.lengths.empty())
    return d.workspace
               ? "No certified length: readings of an instrument hold the scale of the arm, by that "
                 "instrument&rsquo;s calibration."
               : "No certified length: the scale of the arm is not traced.";
  if (!d.workspace) return "The touches do not hold the scale of the arm by them; it is not traced.";
  std::map<std::string, std::string> certificates;
  for (const Length& one : d.lengths)
    if (one.certificate.stated()) certificates.try_emplace(one.certificate.text, shown(one.certificate));
  std::string all;
  for (const auto& [text, html] : certificates) all += (all.empty() ? ": " : ", ") + html;
  return "The certified lengths hold the scale; the unit of length is that of their certificates" +
         all + ".";
}

std::string artefacts(const CertificateData& d) {
  std::string rows;
  for (const Artefact& one : d.artefacts)
    rows += "<tr>" + cell(shown(one.id)) + cell(shown(one.kind)) +
            cell(shown(one.diameter, kNone), true) + cell(shown(one.expanded, kNone), true) +
            cell(shown(one.serial)) + cell(shown(one.certificate)) + cell(shown(one.date)) +
            "</tr>\n";
  std::string html =
      "<h2>Artefacts</h2>\n" +
      table(
          "<th>artefact</th><th>kind</th><th class=\"n\">diameter, mm</th><th class=\"n\">U, "
          "mm</th><th>serial number</th><th>certificate</th><th>of</th>",
          rows);
  rows.clear();
  for (const Length& one : d.lengths)
    rows += "<tr>" + cell(shown(one.from) + " to " + shown(one.to)) +
            cell(shown(one.length), true) + cell(shown(one.expanded), true) +
            cell(shown(one.certificate)) + cell(shown(one.date)) + "</tr>\n";
  if (d.lengths.empty()) return html;
  return html +
         table(
             "<th>certified length</th><th class=\"n\">mm</th><th class=\"n\">U, mm</th>"
             "<th>certificate</th><th>of</th>",
             rows) +
         fmt::format("<p class=\"note\">U: k = {}, from the cell file.</p>\n", constant("k"));
}

std::string length_checks(const CertificateData& d) {
  if (d.length_checks.empty()) return "";
  std::string rows;
  for (const LengthCheck& one : d.length_checks)
    rows += "<tr>" + cell(shown(one.from) + " to " + shown(one.to)) +
            cell(shown(one.certified), true) + cell(shown(one.certified_expanded), true) +
            cell(shown(one.measured), true) + cell(shown(one.expanded), true) +
            cell(shown(one.deviation), true) + cell(shown(one.deviation_expanded), true) +
            "</tr>\n";
  return "<h3>Check of the scale</h3>\n" +
         table(
             "<th>certified length, not fitted</th><th class=\"n\">certified, mm</th>"
             "<th class=\"n\">U, mm</th><th class=\"n\">measured, mm</th><th class=\"n\">U, mm</th>"
             "<th class=\"n\">deviation, mm</th><th class=\"n\">U, mm</th>",
             rows) +
         fmt::format(
             "<p class=\"note\">U: k = {}. Measured: distance of the centres by the calibrated arm.</p>\n",
             constant("k"));
}

std::string budget(const CertificateData& d) {
  if (d.budget.empty()) return "";
  std::string rows;
  for (const BudgetLine& one : d.budget)
    rows += "<tr>" + cell(one.source) + cell(with_unit(one.sigma, kNone), true) + cell("normal") +
            cell(with_unit(one.sensitivity, kNone), true) + cell(shown(one.contribution), true) +
            "</tr>\n";
  rows += "<tr>" + cell("combined standard uncertainty") + cell("") + cell("") + cell("") +
          cell(shown(d.standard), true) + "</tr>\n<tr>" +
          cell("expanded uncertainty U, k = " + constant("k")) + cell("") + cell("") + cell("") +
          cell(shown(d.expanded), true) + "</tr>\n";
  return "<h2>Uncertainty budget of a TCP position</h2>\n" +
         table(
             "<th>source</th><th class=\"n\">standard uncertainty</th><th>distribution</th>"
             "<th class=\"n\">sensitivity</th><th class=\"n\">contribution, mm</th>",
             rows) +
         "<p class=\"note\">Mean over the scope, all three directions; a motion of the base is excluded. The "
         "contributions are uncorrelated, and their squares add up to the combined one. Where a "
         "source has several units its contribution alone is given.</p>\n";
}

std::string list(const std::vector<Entry>& entries) {
  std::string items;
  for (const Entry& one : entries) items += "<li>" + shown(one) + "</li>\n";
  return "<ul>\n" + items + "</ul>\n";
}

std::string frame(const CertificateData& d) {
  return "<h2>Frame, and what is not identifiable</h2>\n<p>Positions are in the robot&rsquo;s base "
         "frame: its root, z along the first axis of the nominal arm. The place of that frame in the "
         "cell is not observable (gauge): it is held by convention at nominal, and a user fixes it "
         "by measuring a base. Errors and uncertainties are stated without it.</p>\n" +
         (d.directions.empty()
              ? std::string("<p>No direction was found that the touches do not determine.</p>\n")
              : list(d.directions));
}

std::string breaks(const CertificateData& d) {
  if (d.dropped.stated()) return "not known: raw rows were dropped on " + shown(d.dropped);
  if (!d.changes_recorded) return "not recorded";
  if (d.breaks.empty()) return "none";
  std::string words;
  for (const Break& one : d.breaks)
    words += fmt::format(
        "<div>{}: {}{}</div>", one.resumed ? "resumed" : "interrupted", moment(one.local, one.utc),
        one.resumed ? std::string()
                    : fmt::format(", in {}, on {}", shown(one.phase), shown(one.event)));
  return words;
}

std::string conditions(const CertificateData& d) {
  return "<h2>Conditions</h2>\n" +
         pairs(pair("Session", shown(d.session)) + pair("Operator", shown(d.operator_name)) +
               pair("Begun", moment(d.began_local, d.began)) +
               pair("Ended", moment(d.ended_local, d.ended)) + pair("Interruptions", breaks(d)) +
               pair("Temperature", d.lowest_c.stated()
                                       ? with_unit(d.lowest_c) + " to " + with_unit(d.highest_c)
                                       : std::string("not recorded")) +
               pair("Touches", shown(d.touches)) + pair("Software, session", shown(d.software)) +
               pair("Software, certificate", shown(d.issuing_software)));
}

/// On the first page.
std::string issue(const CertificateData& d) {
  return "<div class=\"signatures\">" +
         pairs(pair("Issued", moment(d.issued_local, d.issued)) +
               (d.issued_by.stated() ? pair("Issued by", shown(d.issued_by)) : "") +
               pair("Traceability", traceability(d))) +
         "<table class=\"sign\"><tr><td><span>Issued by</span></td><td><span>Reviewed by</span></td>"
         "<td><span>Date</span></td></tr></table></div>\n";
}

std::string sums(const CertificateData& d) {
  std::string rows;
  for (const File& one : d.files)
    rows += "<tr>" + cell(shown(one.role)) + "<td class=\"word\">" + shown(one.name) + "</td>" +
            "<td class=\"hash\">" + shown(one.sha256) + "</td></tr>\n";
  rows += "<tr><td>rows</td><td>all rows of the session in the journal</td><td class=\"hash\">" +
          shown(d.rows_sha256) + "</td></tr>\n";
  rows += "<tr><td>calibration</td><td>the result</td><td class=\"hash\">" +
          shown(d.calibration_sha256) + "</td></tr>\n";
  return "<h2 class=\"appendix\">Appendix: inputs</h2>\n" +
         table("<th>role</th><th>file</th><th>SHA-" + constant("sum") + "</th>", rows);
}

std::string parameters(const CertificateData& d) {
  std::string rows;
  for (const Parameter& one : d.parameters)
    rows += "<tr>" + cell(shown(one.name)) + cell(shown(one.nominal, kNone), true) +
            cell(shown(one.correction, kNone), true) + cell(shown(one.expanded, kNone), true) +
            cell(one.nominal.unit.empty() ? std::string() : unit(one.nominal)) +
            cell(shown(one.decided_by)) + "</tr>\n";
  return "<h2>Appendix: parameters</h2>\n<p class=\"note\">Fitted: " + shown(d.method) + ".</p>\n" +
         table(
             "<th>parameter</th><th class=\"n\">nominal</th><th class=\"n\">correction</th>"
             "<th class=\"n\">U</th><th>unit</th><th>decided by</th>",
             rows, "small") +
         "<p class=\"note\">U includes directions that are held by convention: what &lsquo;frame&rsquo; decides is "
         "no uncertainty of a position.</p>\n";
}

std::string touches(const CertificateData& d) {
  std::string head = "<th class=\"n\">no.</th><th>artefact</th><th>set</th>";
  for (const Entry& name : d.joint_names)
    head += fmt::format("<th class=\"n\">{}, deg</th>", shown(name));
  head +=
      "<th class=\"n\">readings</th><th class=\"n\">mm/s</th><th class=\"n\">&deg;C</th><th>time, UTC</th>";
  std::string rows;
  for (const TouchRow& one : d.rows) {
    rows += "<tr>" + cell(shown(one.number), true) + cell(shown(one.target)) + cell(shown(one.set));
    for (const Entry& joint : one.joints) rows += cell(shown(joint, kNone), true);
    rows += cell(shown(one.readings, kNone), true) + cell(shown(one.speed, kNone), true) +
            cell(shown(one.temperature, kNone), true) + cell(shown(one.time, kNone)) + "</tr>\n";
  }
  return "<div class=\"wide\">\n<h2>Appendix: raw touches</h2>\n" + table(head, rows, "small") +
         "</div>\n";
}

}  // namespace

std::string shown(const Entry& entry, std::string_view otherwise) {
  if (!entry.stated()) return std::string(otherwise);
  return fmt::format("<span data-from=\"{}\">{}</span>", escape(entry.from), escape(entry.text));
}

std::string unit(const Entry& entry) {
  return fmt::format("<span data-from=\"unit({})\">{}</span>", escape(entry.from),
                     escape(entry.unit));
}

std::string with_unit(const Entry& entry, std::string_view otherwise) {
  if (!entry.stated()) return std::string(otherwise);
  return shown(entry) + "&nbsp;" + escape(entry.unit);
}

std::string_view value_of_constant(std::string_view name) {
  for (const auto& [one, value] : kConstants)
    if (one == name) return value;
  return {};
}

std::string constant(const char* name) {
  return shown({std::string(value_of_constant(name)), std::string("method#") + name});
}

std::string to_html(const CertificateData& d) {
  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"{}\">\n"
      "<title>Calibration certificate</title>\n<style>\n{}</style>\n</head>\n<body>\n<main>\n"
      "<h1>Calibration certificate</h1>\n<p class=\"number\">Certificate {}</p>\n",
      escape(kContentPolicy), style_sheet(), shown(d.number));
  if (d.emulated.stated())
    html += fmt::format(
        "<p class=\"emulated\">{}: a simulation, no real robot was touched. This document "
        "certifies no robot.</p>\n",
        shown(d.emulated));
  html += issue(d) + object(d) + result(d) + decision(d) + artefacts(d) + length_checks(d) + budget(d) +
          pose_sheet_html(d.pose_sheet) + frame(d) + conditions(d);
  html += "<h2>Remarks of the verdict</h2>\n" + list(d.remarks);
  html += sums(d) + parameters(d) + touches(d);
  return html + "</main>\n</body>\n</html>\n";
}

// One style for screen and print (A4, black on white).

const char* style_sheet() {
  return R"css(
@page {
  size: A4; margin: 16mm 16mm 20mm 16mm;
  @bottom-left { content: string(number); font: 8pt "DejaVu Sans", sans-serif; color: #555; }
  @bottom-right { content: "page " counter(page) " of " counter(pages);
    font: 8pt "DejaVu Sans", sans-serif; color: #555; }
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
