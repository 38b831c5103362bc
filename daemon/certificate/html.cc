// Sections of the certificate, in their order.

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <functional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "calib/model/enum_table.h"
#include "calib/model/parameter_key.h"
#include "daemon/certificate/certificate.h"
#include "daemon/files/child.h"
#include "daemon/report/say.h"

namespace cellcal::daemon::certificate {

/// certificate.css, compiled in by the build.
extern const std::string_view kStyle;

namespace {

using report::escape, report::say;
using Json = nlohmann::ordered_json;

constexpr const char* kNone = "\xE2\x80\x93";

constexpr std::array<std::pair<std::string_view, std::string_view>, 8> kConstants{
    {{"k", "2"},
     {"percent", "95"},
     {"guidance", "ILAC-G8:09/2019"},
     {"standard", "14253-1"},
     {"sum", "256"},
     {"guard_band", "0"},
     {"performance", "9283"},
     {"cycles", "30"}}};

/// With its origin, and numbers with the document's decimal mark.
std::string shown(const Entry& entry) {
  if (!entry.stated()) return say("say.report.not_stated");
  return fmt::format("<span data-from=\"{}\">{}</span>", escape(entry.from),
                     escape(entry.value ? report::localised(entry.text) : entry.text));
}

std::string dashed(const Entry& entry) { return entry.stated() ? shown(entry) : kNone; }

/// As in files: with a decimal point.
std::string raw(const Entry& entry) {
  const report::Speaking plain((calib::Language()));
  return dashed(entry);
}

/// The number followed by its unit.
std::string with_unit(const Entry& entry) {
  return entry.stated() ? shown(entry) + "&nbsp;" + escape(report::unit_word(entry.unit)) : kNone;
}

/// The unit only, as "unit(origin)".
std::string unit(const Entry& entry) {
  if (entry.unit.empty()) return {};
  return fmt::format("<span data-from=\"unit({})\">{}</span>", escape(entry.from),
                     escape(report::unit_word(entry.unit)));
}

/// A constant of the method (README, Origins).
std::string constant(const char* name) {
  return shown({std::string(value_of_constant(name)), std::string("method#") + name});
}

/// `css`: "n" of numbers.
std::string cell(const std::string& html, const std::string& css = "") {
  return fmt::format("<td{}>{}</td>", css.empty() ? "" : fmt::format(" class=\"{}\"", css), html);
}

std::string pair(const char* name, const std::string& html) {
  return report::pair_row(say(name), html);
}
std::string pair(const CertificateData& d, const char* name, const char* key) {
  return pair(name, shown(d.entry(key)));
}

std::string pairs(const std::string& rows) {
  return "<table class=\"pairs\">\n" + rows + "</table>\n";
}

std::string note(const calib::Phrase& phrase) { return report::paragraph("note", say(phrase)); }

std::string heading(const char* id) { return "<h2>" + say(id) + "</h2>\n"; }

/// Local time, followed by UTC; `path`: of the latter.
std::string moment(const Json& of, const std::string& path, const std::string& local_path) {
  const Entry utc = entry_at(of, path);
  return utc.stated() ? fmt::format("{} &middot; {}", shown(entry_at(of, local_path)), shown(utc))
                      : shown(utc);
}

/// In another language than English as that phrase.
std::string shown_as(Entry entry, const calib::Phrase& phrase) {
  if (report::language() != calib::Language() && entry.stated()) entry.text = say(phrase);
  return shown(entry);
}

/// A sentence of the content.
std::string sentence(const CertificateData& d, const Entry& entry) {
  return shown_as(entry, d.phrase(entry.text));
}

/// A name of the files ("sphere", "fast search") in the document's language, where it has an entry.
std::string named(const char* ids, const Entry& entry) {
  const std::string id = ids + entry.text;
  return shown_as(entry, calib::sentence_of(id) ? id : entry.text);
}

/// Column of a table: its head, an id of the catalogue or HTML, and its cells of a row.
struct Column {
  std::string head;
  std::function<std::string(const Json& row)> html;
  std::string css{};  ///< of the cells; "n": numbers, their head as well
};

using Written = std::string (*)(const Entry&);

Column text(std::string head, std::string path, Written written = shown, std::string css = "") {
  return {std::move(head),
          [path, written](const Json& row) { return written(entry_at(row, path)); },
          std::move(css)};
}
Column number(std::string head, std::string path, Written written = dashed) {
  return text(std::move(head), std::move(path), written, "n");
}
Column name(std::string head, std::string path, const char* ids) {
  return {std::move(head),
          [path, ids](const Json& row) { return named(ids, entry_at(row, path)); }};
}

/// `more`: further rows, as HTML.
std::string table(const std::vector<Column>& columns, const Json& rows, const std::string& css = "",
                  const std::string& more = "") {
  std::string head, body;
  for (const Column& one : columns)
    head += fmt::format("<th{}>{}</th>", one.css == "n" ? " class=\"n\"" : "", say(one.head));
  for (const Json& row : rows) {
    body += "<tr>";
    for (const Column& one : columns) body += cell(one.html(row), one.css);
    body += "</tr>\n";
  }
  return fmt::format("<table{}>\n<thead><tr>{}</tr></thead>\n<tbody>\n{}</tbody></table>\n",
                     css.empty() ? "" : fmt::format(" class=\"{}\"", css), head, body + more);
}

std::string object(const CertificateData& d) {
  const Entry tip = d.entry("tip_radius");
  return heading("say.certificate.object") + "<div class=\"columns\">" +
         pairs(pair(d, "say.certificate.robot", "robot") +
               pair(d, "say.certificate.robot_serial", "robot_serial") +
               pair(d, "say.certificate.controller_serial", "controller_serial") +
               (d.entry("tool").stated() ? pair(d, "say.certificate.tool", "tool") : "") +
               pair("say.certificate.tip_radius", tip.stated() ? with_unit(tip) : shown(tip)) +
               pair(d, "say.certificate.sensor", "sensor") +
               pair(d, "say.certificate.sensor_serial", "sensor_serial") +
               pair(d, "say.certificate.site", "site") + pair(d, "say.certificate.cell", "cell")) +
         "</div>\n";
}

std::string figures(const CertificateData& d) {
  std::string rows;
  for (const Json& one : d.content.at("figures"))
    rows += fmt::format("<tr><th scope=\"row\">{}</th>{}{}</tr>\n", say(d.phrase(one.at("what"))),
                        cell(dashed(entry_at(one, "as_found")), "n"),
                        cell(dashed(entry_at(one, "as_left")), "n"));
  std::string found = d.content.at("as_found_by").is_null()
                          ? say("say.certificate.found_by.nominal")
                          : say({"say.certificate.found_by",
                                 {{"calibration", sentence(d, d.entry("as_found_by"))}}});
  if (d.content.at("earlier_not_comparable"))
    found += say("say.certificate.found_by.not_comparable");
  const Entry poses = d.entry("poses");
  return fmt::format(
             "<table class=\"whole\">\n<thead><tr><th scope=\"col\">mm</th>"
             "<th scope=\"col\" class=\"n\">{}</th><th scope=\"col\" class=\"n\">{}</th></tr></thead>\n"
             "<tbody>\n{}</tbody></table>\n",
             say("say.certificate.as_found"), say("say.certificate.as_left"), rows) +
         note(
             {"say.certificate.figures.note",
              {{"found", found},
               {"poses", poses.stated() ? say({"say.certificate.over_poses", {{"n", shown(poses)}}})
                                        : std::string()},
               {"k", constant("k")},
               {"percent", constant("percent")}}});
}

std::string result(const CertificateData& d) {
  const bool workspace = d.content.at("scope") == "workspace";
  return heading("say.certificate.result") +
         fmt::format(
             "<div class=\"result\"><p class=\"verdict\">{}</p>\n<p>{}</p></div>\n",
             say(workspace ? "say.certificate.accepted.workspace"
                           : "say.certificate.accepted.near"),
             say(workspace ? "say.certificate.holds.workspace" : "say.certificate.holds.near")) +
         figures(d);
}

std::string decision(const CertificateData& d) {
  const Json& rule = d.content.at("decision");
  if (rule.is_null())
    return heading("say.certificate.rule") +
           report::paragraph("", say("say.certificate.rule.not_recorded"));
  const auto value = [&](const char* key) { return with_unit(entry_at(rule, key)); };
  return heading("say.certificate.rule") +
         report::paragraph("", say({"say.certificate.rule.simple",
                                    {{"guidance", constant("guidance")},
                                     {"guard_band", constant("guard_band")},
                                     {"standard", constant("standard")},
                                     {"predicted", value("predicted")},
                                     {"required", value("required")},
                                     {"by", say(rule.at("limit_by") == "cell file"
                                                    ? "say.certificate.rule.by_cell_file"
                                                    : "say.certificate.rule.by_default")},
                                     {"most_of_nominal", value("most_of_nominal")},
                                     {"nominal", value("nominal")},
                                     {"of_nominal", value("of_nominal")}}}));
}

/// Source of the scale, with the certificates of its lengths.
std::string traceability(const CertificateData& d) {
  if (d.scale == calib::ScaleBy::kReadings) return say("say.certificate.traceability.instrument");
  if (d.scale != calib::ScaleBy::kLengths)
    return say(d.content.at("lengths").empty() ? "say.certificate.no_length"
                                               : "say.certificate.traceability.none");
  calib::Phrase all;
  for (const auto& [text, entry] : d.scale_certificates)
    all = joined("say.join.comma", all, shown(entry));
  return all.empty() ? say("say.certificate.traceability.held")
                     : say({"say.certificate.traceability", {{"certificates", all}}});
}

std::string between(const Json& length) {
  return say({"say.report.lengths.between",
              {{"from", shown(entry_at(length, "between/0"))},
               {"to", shown(entry_at(length, "between/1"))}}});
}

std::string certified_lengths(const CertificateData& d) {
  const Json& lengths = d.content.at("lengths");
  if (lengths.empty()) return {};
  return table({{"say.certificate.col.length", between},
                number("mm", "length", shown),
                number("say.certificate.col.u_mm", "expanded", shown),
                text("say.certificate.col.certificate", "certificate"),
                text("say.certificate.col.date", "certificate_date")},
               lengths) +
         note({"say.certificate.lengths.u", {{"k", constant("k")}}});
}

std::string artefacts(const CertificateData& d) {
  return heading("say.certificate.artefacts") +
         table({text("say.certificate.col.artefact", "id"),
                name("say.report.col.kind", "kind", "say.report.kind."),
                number("say.certificate.col.diameter", "diameter"),
                number("say.certificate.col.u_mm", "expanded"),
                text("say.certificate.col.serial", "serial"),
                text("say.certificate.col.certificate", "certificate"),
                text("say.certificate.col.date", "certificate_date")},
               d.content.at("artefacts")) +
         certified_lengths(d);
}

std::string length_checks(const CertificateData& d) {
  const Json& checks = d.content.at("length_checks");
  if (checks.empty()) return "";
  return "<h3>" + say("say.certificate.scale") + "</h3>\n" +
         table({{"say.certificate.col.not_fitted", between},
                number("say.certificate.col.certified", "certified", shown),
                number("say.certificate.col.u_mm", "certified_expanded", shown),
                number("say.certificate.col.measured", "measured", shown),
                number("say.certificate.col.u_mm", "expanded", shown),
                number("say.certificate.col.deviation", "deviation", shown),
                number("say.certificate.col.u_mm", "deviation_expanded", shown)},
               checks) +
         note({"say.certificate.scale.note", {{"k", constant("k")}}});
}

std::string budget(const CertificateData& d) {
  const Json& budget = d.content.at("uncertainty_budget");
  if (budget.at("lines").empty()) return "";
  const auto total = [&](const calib::Phrase& name, const char* key) {
    return "<tr>" + cell(say(name)) + cell("") + cell("") + cell("") +
           cell(shown(entry_at(budget, key)), "n") + "</tr>\n";
  };
  return heading("say.certificate.budget") +
         table({{"say.certificate.col.source",
                 [&](const Json& line) { return say(d.phrase(line.at("source"))); }},
                number("say.certificate.col.standard", "sigma", with_unit),
                {"say.certificate.col.distribution",
                 [](const Json&) { return say("say.certificate.normal"); }},
                number("say.certificate.col.sensitivity", "sensitivity", with_unit),
                number("say.certificate.col.contribution", "contribution", shown)},
               budget.at("lines"), "",
               total("say.certificate.combined", "standard") +
                   total({"say.certificate.expanded", {{"k", constant("k")}}}, "expanded")) +
         note("say.certificate.budget.note");
}

std::string pose_sheet(const CertificateData& d) {
  const Json& sheet = d.content.at("pose_sheet");
  if (sheet.is_null()) return "";
  const Json &accuracy = sheet.at("accuracy"), &repeatability = sheet.at("repeatability");
  std::string html =
      "<h2>" + say({"say.certificate.poses", {{"standard", constant("performance")}}}) + "</h2>\n";
  if (!accuracy.empty())
    html += table({text("say.certificate.ap.of", "target"),
                   number("say.certificate.ap.poses", "poses", shown),
                   number("say.certificate.ap.mean", "ap_mean", shown),
                   number("say.certificate.ap.largest", "ap_largest", shown),
                   number("say.certificate.ap.predicted", "predicted", shown)},
                  accuracy);
  if (!repeatability.empty())
    html += table(
        {text("say.certificate.rp.place", "target"),
         number("say.certificate.rp.first", "first", shown),
         number("say.certificate.rp.repeats", "repeats", shown),
         number("say.certificate.rp.mean", "mean", shown), number("s, mm", "sigma", shown),
         number("RP, mm", "rp", shown), number("say.certificate.rp.predicted", "predicted", shown)},
        repeatability);
  return html + note({repeatability.empty() ? "say.certificate.poses.note.no_rp"
                                            : "say.certificate.poses.note",
                      {{"standard", constant("performance")}, {"cycles", constant("cycles")}}});
}

std::string list(const CertificateData& d, const char* key) {
  std::string items;
  for (const Json& one : d.content.at(key)) items += "<li>" + sentence(d, one) + "</li>\n";
  return "<ul>\n" + items + "</ul>\n";
}

std::string frame(const CertificateData& d) {
  return heading("say.certificate.frame") +
         report::paragraph("", say("say.certificate.frame.note")) +
         (d.content.at("not_identifiable").empty()
              ? report::paragraph("", say("say.certificate.frame.none"))
              : list(d, "not_identifiable"));
}

std::string breaks(const CertificateData& d) {
  const Json& breaks = d.content.at("breaks");
  if (breaks == "not known")
    return say({"say.certificate.breaks.dropped", {{"at", shown(d.entry("raw_rows_dropped"))}}});
  if (breaks == "not recorded") return say("say.certificate.not_recorded");
  if (breaks.empty()) return say("say.certificate.breaks.none");
  std::string words;
  for (const Json& one : breaks) {
    const std::string at = moment(one, "utc", "local");
    words += fmt::format("<div>{}</div>",
                         one.at("what") == "resumed"
                             ? say({"say.certificate.breaks.resumed", {{"at", at}}})
                             : say({"say.certificate.breaks.interrupted",
                                    {{"at", at},
                                     {"phase", named("say.phase.", entry_at(one, "phase"))},
                                     {"event", named("say.happened.", entry_at(one, "event"))}}}));
  }
  return words;
}

std::string conditions(const CertificateData& d) {
  const Entry lowest = d.entry("lowest_temperature");
  const std::string temperature =
      lowest.stated()
          ? say({"say.certificate.temperature.range",
                 {{"low", with_unit(lowest)}, {"high", with_unit(d.entry("highest_temperature"))}}})
          : say("say.certificate.not_recorded");
  return heading("say.certificate.conditions") +
         pairs(pair(d, "say.report.session", "session") +
               pair(d, "say.certificate.operator", "operator") +
               pair("say.certificate.begun", moment(d.content, "began", "began_local")) +
               pair("say.certificate.ended", moment(d.content, "ended", "ended_local")) +
               pair("say.certificate.breaks", breaks(d)) +
               pair("say.certificate.temperature", temperature) +
               pair(d, "say.certificate.touches", "touches") +
               pair(d, "say.certificate.software.session", "software") +
               pair(d, "say.certificate.software.issue", "issuing_software"));
}

/// On the first page.
std::string issue(const CertificateData& d) {
  const auto field = [](const char* id) { return "<td><span>" + say(id) + "</span></td>"; };
  return "<div class=\"signatures\">" +
         pairs(pair("say.certificate.issued", moment(d.content, "issued", "issued_local")) +
               (d.entry("issued_by").stated() ? pair(d, "say.certificate.issued_by", "issued_by")
                                              : "") +
               pair("say.certificate.traceability.head", traceability(d))) +
         "<table class=\"sign\"><tr>" + field("say.certificate.issued_by") +
         field("say.report.reviewed_by") + field("say.report.date") + "</tr></table></div>\n";
}

std::string sums(const CertificateData& d) {
  const auto row = [&](const char* role, const char* what, const char* key) {
    return "<tr>" + cell(say(role)) + cell(say(what)) + cell(shown(d.entry(key)), "hash") +
           "</tr>\n";
  };
  return "<h2 class=\"appendix\">" + say("say.certificate.inputs") + "</h2>\n" +
         table({name("say.report.files.col.role", "role", "say.report.files.role."),
                text("say.report.files.col.file", "name", shown, "word"),
                text("SHA-" + constant("sum"), "sha256", shown, "hash")},
               d.content.at("files"), "",
               row("say.certificate.rows", "say.certificate.rows.what", "rows_sha256") +
                   row("say.certificate.calibration", "say.certificate.calibration.what",
                       "calibration_sha256"));
}

std::string parameters(const CertificateData& d) {
  return heading("say.certificate.parameters") +
         note({"say.certificate.fitted", {{"method", sentence(d, d.entry("method"))}}}) +
         table(
             {text("say.report.col.parameter", "name"), number("say.report.col.nominal", "nominal"),
              number("say.report.col.correction", "correction"), number("U", "expanded"),
              text("say.report.col.unit", "nominal", unit),
              name("say.report.col.decided_by", "decided_by", "say.report.decided.")},
             d.content.at("parameters"), "small") +
         note("say.certificate.parameters.note");
}

std::string positioner(const CertificateData& d) {
  if (!d.content.contains("positioner")) return {};
  return heading("say.report.positioner") +
         table({text("say.report.positioner.col.axis", "axis"), number("x, mm", "xyz/0"),
                number("y, mm", "xyz/1"), number("z, mm", "xyz/2"),
                number("say.report.positioner.col.direction_x", "direction/0"),
                number("y", "direction/1"), number("z", "direction/2"),
                number("say.report.positioner.col.place", "place_u95"),
                number("say.report.positioner.col.direction", "direction_u95")},
               d.content.at("positioner"), "small") +
         note("say.report.positioner.note");
}

std::string linear_unit(const CertificateData& d) {
  if (!d.content.contains("linear_unit")) return {};
  const Json& unit = d.content.at("linear_unit");
  std::vector<Column> motions{number("say.report.linear_unit.col.at", "position", shown)};
  for (int k = 0; k < calib::kGuideMotions; ++k) {
    motions.push_back(
        number(std::string("say.report.linear_unit.col.") + own_name(calib::GuideMotion{k}),
               fmt::format("motion/{}", k)));
    motions.push_back(number("U", fmt::format("u95/{}", k)));
  }
  return heading("say.report.linear_unit") +
         table({text("say.report.positioner.col.axis", "axis"),
                number("say.report.positioner.col.direction_x", "direction/0"),
                number("y", "direction/1"), number("z", "direction/2"),
                number("say.report.positioner.col.direction", "direction_u95"),
                number("say.report.linear_unit.col.scale", "scale"), number("U", "scale_u95")},
               Json::array({unit}), "small") +
         table(motions, unit.at("at"), "small") + note("say.report.linear_unit.note");
}

std::string touches(const CertificateData& d) {
  std::vector<Column> columns{number("say.report.raw.col.number", "number", raw),
                              text("say.certificate.col.artefact", "target"),
                              name("say.report.raw.col.set", "set", "say.report.raw.set.")};
  for (std::size_t j = 0; const Json& joint : d.content.at("joints")) {
    const Entry name = joint;
    columns.push_back({shown(name) + ", " + (name.unit == "mm" ? "mm" : say("say.unit.deg")),
                       [j](const Json& touch) {
                         const Json& joints = touch.at("joints");
                         return j < joints.size() ? raw(joints[j]) : kNone;
                       },
                       "n"});
    ++j;
  }
  columns.insert(columns.end(), {number("say.report.raw.col.readings", "readings", raw),
                                 number("mm/s", "speed", raw), number("&deg;C", "temperature", raw),
                                 text("say.certificate.col.time", "time", raw)});
  return "<div class=\"wide\">\n" + heading("say.certificate.raw") +
         table(columns, d.content.at("raw_touches"), "small") + "</div>\n";
}

}  // namespace

std::string_view value_of_constant(std::string_view name) {
  for (const auto& [one, value] : kConstants)
    if (one == name) return value;
  return {};
}

std::string document_name(const calib::Language& language, const std::string& extension) {
  return report::file_name("certificate", language, extension);
}

std::string to_html(const CertificateData& d, const calib::Language& language) {
  const report::Speaking speaking(language);
  const std::string title = say("say.certificate.title");
  std::string html =
      report::begin_document(title, fmt::format("{}@page {{ @bottom-right {{ content: {}; }} }}\n",
                                                kStyle, say("say.certificate.page_of"))) +
      "<h1>" + title + "</h1>\n" +
      report::paragraph("number",
                        say({"say.certificate.number", {{"number", shown(d.entry("number"))}}}));
  if (!d.content.at("emulated").is_null())
    html += report::paragraph("emulated", say({"say.certificate.emulated",
                                               {{"cell", sentence(d, d.entry("emulated"))}}}));
  html += issue(d) + object(d) + result(d) + decision(d) + artefacts(d) + length_checks(d) +
          budget(d) + pose_sheet(d) + frame(d) + conditions(d);
  html += heading("say.certificate.remarks") + list(d, "remarks");
  html += sums(d) + parameters(d) + positioner(d) + linear_unit(d) + touches(d);
  return html + "</main>\n</body>\n</html>\n";
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
