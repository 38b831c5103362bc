// Digital Calibration Certificate, schema 3.1.2 of PTB (https://ptb.de/dcc), quantities as D-SI 2.1.0.

#include <fmt/format.h>

#include <algorithm>
#include <pugixml.hpp>
#include <sstream>

#include "calib/model/enum_table.h"
#include "calib/model/parameter_key.h"
#include "daemon/certificate/certificate.h"

namespace cellcal::daemon::certificate {

namespace {

using Node = pugi::xml_node;
using Json = nlohmann::ordered_json;

constexpr const char* kSchema = "3.1.2";
/// Required by the schema where the journal and the cell file have nothing.
constexpr const char* kNotStated = "say.report.not_stated";
/// ISO 3166 user-assigned code; no country is stated.
constexpr const char* kNoCountry = "XX";
constexpr const char* kProbability = "0.95";

/// Units of entries as D-SI writes them; empty: none that D-SI has.
std::string d_si(const std::string& unit) {
  constexpr std::pair<const char*, const char*> kUnits[] = {
      {"", "\\one"},
      {"mm", "\\milli\\metre"},
      {"mm/s", "\\milli\\metre\\second\\tothe{-1}"},
      {"deg", "\\degree"},
      {"mrad", "\\milli\\radian"},
      {"mm/m", "\\milli\\metre\\metre\\tothe{-1}"},
      {"mrad/m", "\\milli\\radian\\metre\\tothe{-1}"},
      {"mrad/rad", "\\milli\\radian\\radian\\tothe{-1}"},
      {"arcsec", "\\arcsecond"},
      {"ms", "\\milli\\second"},
      {"%", "\\percent"},
      {"°C", "\\degreecelsius"},
      {"rad/(N m)", "\\radian\\newton\\tothe{-1}\\metre\\tothe{-1}"},
      {"kg m rad/(N m)", "\\kilogram\\radian\\newton\\tothe{-1}"},
      {"1/(N m^2)", "\\newton\\tothe{-1}\\metre\\tothe{-2}"}};
  for (const auto& [own, written] : kUnits)
    if (unit == own) return written;
  return {};
}

Node add(Node parent, const char* name, const std::string& text) {
  Node node = parent.append_child(name);
  node.text().set(text.c_str());
  return node;
}

/// English first.
std::vector<calib::Language> languages() {
  std::vector<calib::Language> all{{}};
  for (const std::string& code : calib::Language::codes())
    if (const auto one = calib::Language::of(code); *one != all.front()) all.push_back(*one);
  return all;
}

/// dcc:textType and dcc:richContentType of one sentence, in every language.
Node add_text(Node parent, const char* name, const calib::Phrase& text) {
  Node node = parent.append_child(name);
  for (const calib::Language& language : languages())
    add(node, "dcc:content", words(text, language)).append_attribute("lang") =
        language.code().c_str();
  return node;
}

calib::Phrase or_not_stated(const Entry& entry) {
  return entry.stated() ? calib::Phrase(entry.text) : kNotStated;
}

/// Text of monolingual elements.
std::string text_or_not_stated(const Entry& entry) { return words(or_not_stated(entry)); }

void add_contact(Node parent, const char* name, const Entry& who, const Entry& where) {
  Node contact = parent.append_child(name);
  add_text(contact, "dcc:name", or_not_stated(who));
  add(contact, "dcc:eMail", words(calib::Phrase(kNotStated)));
  add(contact.append_child("dcc:location"), "dcc:city", text_or_not_stated(where));
}

void add_software(Node parent, const char* list, const Entry& release) {
  Node software = parent.append_child(list).append_child("dcc:software");
  add_text(software, "dcc:name", "cellcal");
  add(software, "dcc:release", text_or_not_stated(release));
  add(software, "dcc:type", "application");
}

bool is_stated(const Json& of, const char* key) {
  return of.contains(key) && entry_at(of, key).stated();
}

struct Identification {
  const char *issuer, *name, *key;
};

/// Only entries that are stated.
Node add_identifications(Node parent, const Json& of, std::initializer_list<Identification> all) {
  Node list = parent.append_child("dcc:identifications");
  for (const auto& [issuer, name, key] : all) {
    if (!is_stated(of, key)) continue;
    Node one = list.append_child("dcc:identification");
    add(one, "dcc:issuer", issuer);
    add(one, "dcc:value", entry_at(of, key).text);
    add_text(one, "dcc:name", name);
  }
  return list;
}

/// A number with its unit and, if stated, its expanded uncertainty; text where it is no number.
void add_value(Node parent, const Entry& value, const Entry& expanded) {
  const std::string unit = d_si(value.unit);
  if (!value.value || unit.empty()) {
    add(parent.append_child("dcc:noQuantity"), "dcc:content",
        value.unit.empty() ? value.text : value.text + " " + value.unit);
    return;
  }
  Node real = parent.append_child("si:real");
  add(real, "si:value", fmt::format("{}", *value.value));
  add(real, "si:unit", unit);
  if (!expanded.value) return;
  Node uncertainty = real.append_child("si:expandedUnc");
  add(uncertainty, "si:uncertainty", fmt::format("{}", *expanded.value));
  add(uncertainty, "si:coverageFactor", fmt::format("{}", kCoverage));
  add(uncertainty, "si:coverageProbability", kProbability);
}

void add_quantity(Node data, const calib::Phrase& name, const Entry& value,
                  const Entry& expanded = {}) {
  if (!value.stated()) return;
  Node quantity = data.append_child("dcc:quantity");
  add_text(quantity, "dcc:name", name);
  add_value(quantity, value, expanded);
}

/// "2026-11-22T..." or "2026-11-22 ...": the day.
std::string day_of(const Entry& utc) { return utc.text.substr(0, 10); }

void add_core_data(const CertificateData& d, Node administrative) {
  Node core = administrative.append_child("dcc:coreData");
  add(core, "dcc:countryCodeISO3166_1", kNoCountry);
  for (const calib::Language& language : languages())
    add(core, "dcc:usedLangCodeISO639_1", language.code());
  add(core, "dcc:mandatoryLangCodeISO639_1", "en");
  add(core, "dcc:uniqueIdentifier", d.entry("number").text);
  add_identifications(core, d.content,
                      {{"calibrationLaboratory", "say.dcc.session", "session"},
                       {"owner", "say.dcc.cell", "cell"},
                       {"calibrationLaboratory", "say.dcc.sum", "calibration_sha256"}});
  add(core, "dcc:beginPerformanceDate", day_of(d.entry("began")));
  add(core, "dcc:endPerformanceDate", day_of(d.entry("ended")));
  add(core, "dcc:performanceLocation", "customer");
}

void add_items(const CertificateData& d, Node administrative) {
  Node item = administrative.append_child("dcc:items").append_child("dcc:item");
  add_text(item, "dcc:name", "say.dcc.item");
  add_text(item.append_child("dcc:manufacturer"), "dcc:name", kNotStated);
  add(item, "dcc:model", text_or_not_stated(d.entry("robot")));
  const Node identifications =
      add_identifications(item, d.content,
                          {{"manufacturer", "say.dcc.robot_serial", "robot_serial"},
                           {"manufacturer", "say.dcc.controller_serial", "controller_serial"},
                           {"owner", "say.dcc.tool", "tool"},
                           {"owner", "say.dcc.cell", "cell"}});
  if (identifications.first_child()) return;
  item.remove_child(identifications);
  add_identifications(item, d.content,
                      {{"calibrationLaboratory", "say.dcc.certificate", "number"}});
}

void add_statement(Node statements, const calib::Phrase& text) {
  add_text(statements.append_child("dcc:statement"), "dcc:declaration", text);
}

/// Decision rule, scope, remarks, and what limits the result.
void add_statements(const CertificateData& d, Node administrative) {
  Node statements = administrative.append_child("dcc:statements");
  add_statement(statements, d.content.at("scope") == "workspace" ? "say.dcc.scope.workspace"
                                                                 : "say.dcc.scope.near");
  if (!d.content.at("emulated").is_null()) add_statement(statements, "say.dcc.emulated");
  if (const Json& decision = d.content.at("decision"); !decision.is_null()) {
    Node rule = statements.append_child("dcc:statement");
    add(rule, "dcc:convention", "simple acceptance");
    add_text(rule, "dcc:declaration",
             decision.at("limit_by") == "cell file" ? "say.dcc.limit.cell_file"
                                                    : "say.dcc.limit.default");
    add(rule, "dcc:conformity", "pass");
    Node data = rule.append_child("dcc:data");
    add_quantity(data, "say.dcc.predicted", decision.at("predicted"));
    add_quantity(data, "say.dcc.permitted", decision.at("required"));
  }
  for (const Json& one : d.content.at("not_identifiable"))
    add_statement(statements, {"say.dcc.not_identifiable", {{"words", d.phrase(one.at("text"))}}});
  for (const Json& one : d.content.at("remarks"))
    add_statement(statements, d.phrase(one.at("text")));
}

void add_administrative(const CertificateData& d, Node root) {
  Node administrative = root.append_child("dcc:administrativeData");
  const Entry issuer = d.entry("issued_by"), site = d.entry("site");
  add_software(administrative, "dcc:dccSoftware", d.entry("issuing_software"));
  add_core_data(d, administrative);
  add_items(d, administrative);
  add_contact(administrative.append_child("dcc:calibrationLaboratory"), "dcc:contact", issuer,
              site);
  Node person = administrative.append_child("dcc:respPersons").append_child("dcc:respPerson");
  add_text(person.append_child("dcc:person"), "dcc:name",
           or_not_stated(is_stated(d.content, "operator") ? d.entry("operator") : issuer));
  add(person, "dcc:mainSigner", "true");
  add_contact(administrative, "dcc:customer", site, site);
  add_statements(d, administrative);
}

/// Kind of the cell file as a word of the language.
calib::Phrase kind_of(const Entry& kind) {
  const std::string id = "say.report.kind." + kind.text;
  return calib::sentence_of(id) ? calib::Phrase(id) : or_not_stated(kind);
}

calib::Phrase of_ends(const char* id, const Json& length) {
  return {
      id,
      {{"from", entry_at(length, "between/0").text}, {"to", entry_at(length, "between/1").text}}};
}

/// With the certified value at `key`.
void add_certified(Node list, const calib::Phrase& name, const Json& of, const char* quantity_name,
                   const char* key) {
  Node one = list.append_child("dcc:measuringEquipment");
  add_text(one, "dcc:name", name);
  if (is_stated(of, "serial") || is_stated(of, "certificate"))
    add_identifications(one, of,
                        {{"manufacturer", "say.dcc.serial", "serial"},
                         {"other", "say.dcc.certificate", "certificate"},
                         {"other", "say.dcc.certificate_date", "certificate_date"}});
  if (!is_stated(of, key)) return;
  Node quantity = one.append_child("dcc:measuringEquipmentQuantities")
                      .append_child("dcc:measuringEquipmentQuantity");
  add_text(quantity, "dcc:name", quantity_name);
  add_value(quantity, of.at(key), of.at("expanded"));
}

void add_equipments(const CertificateData& d, Node result) {
  Node list = result.append_child("dcc:measuringEquipments");
  const Json& artefacts = d.content.at("artefacts");
  for (const Json& one : artefacts)
    add_certified(list,
                  {"say.dcc.artefact",
                   {{"kind", kind_of(one.at("kind"))}, {"name", entry_at(one, "id").text}}},
                  one, "say.dcc.diameter", "diameter");
  for (const Json& one : d.content.at("lengths"))
    add_certified(list, of_ends("say.dcc.length", one), one, "say.dcc.distance", "length");
  if (!is_stated(d.content, "sensor") && !artefacts.empty()) return;
  Node sensor = list.append_child("dcc:measuringEquipment");
  add_text(sensor, "dcc:name", {"say.dcc.sensor", {{"name", or_not_stated(d.entry("sensor"))}}});
  if (is_stated(d.content, "sensor_serial"))
    add_identifications(sensor, d.content, {{"manufacturer", "say.dcc.serial", "sensor_serial"}});
}

void add_conditions(const CertificateData& d, Node result) {
  if (!is_stated(d.content, "lowest_temperature")) return;
  Node condition =
      result.append_child("dcc:influenceConditions").append_child("dcc:influenceCondition");
  add_text(condition, "dcc:name", "say.dcc.temperature");
  Node data = condition.append_child("dcc:data");
  add_quantity(data, "say.dcc.lowest", d.entry("lowest_temperature"));
  add_quantity(data, "say.dcc.highest", d.entry("highest_temperature"));
}

Node add_result(Node results, const char* name) {
  Node result = results.append_child("dcc:result");
  add_text(result, "dcc:name", name);
  return result.append_child("dcc:data");
}

/// `key`: "as_found" or "as_left".
void add_figures(const CertificateData& d, Node results, const char* name, const char* key) {
  const Json& figures = d.content.at("figures");
  if (std::ranges::none_of(figures, [&](const Json& one) { return is_stated(one, key); })) return;
  Node data = add_result(results, name);
  for (const Json& one : figures) add_quantity(data, d.phrase(one.at("what")), one.at(key));
}

constexpr std::array kPointIds{"say.dcc.positioner.x", "say.dcc.positioner.y",
                               "say.dcc.positioner.z"},
    kDirectionIds{"say.dcc.positioner.direction_x", "say.dcc.positioner.direction_y",
                  "say.dcc.positioner.direction_z"};

void add_three(Node data, const std::array<const char*, 3>& ids, const std::string& axis,
               const Json& values) {
  for (std::size_t k = 0; k < ids.size(); ++k)
    add_quantity(data, {ids[k], {{"axis", axis}}}, values.at(k));
}

/// Bounds are of distances and angles across the axis, not of components.
void add_positioner(const Json& axes, Node data) {
  for (const Json& one : axes) {
    const std::string axis = entry_at(one, "axis").text;
    add_three(data, kPointIds, axis, one.at("xyz"));
    add_three(data, kDirectionIds, axis, one.at("direction"));
    add_quantity(data, {"say.dcc.positioner.place", {{"axis", axis}}}, one.at("place_u95"));
    add_quantity(data, {"say.dcc.positioner.direction", {{"axis", axis}}}, one.at("direction_u95"));
  }
}

void add_linear_unit(const Json& unit, Node data) {
  const std::string axis = entry_at(unit, "axis").text;
  add_three(data, kDirectionIds, axis, unit.at("direction"));
  add_quantity(data, {"say.dcc.positioner.direction", {{"axis", axis}}}, unit.at("direction_u95"));
  add_quantity(data, {"say.dcc.linear_unit.scale", {{"axis", axis}}}, unit.at("scale"),
               unit.at("scale_u95"));
  for (const Json& place : unit.at("at"))
    for (int k = 0; k < calib::kGuideMotions; ++k)
      add_quantity(data,
                   {std::string("say.dcc.linear_unit.") + own_name(calib::GuideMotion{k}),
                    {{"axis", axis}, {"at", entry_at(place, "position").text}}},
                   place.at("motion").at(k), place.at("u95").at(k));
}

void add_measurement(const CertificateData& d, Node root) {
  Node result = root.append_child("dcc:measurementResults").append_child("dcc:measurementResult");
  add_text(result, "dcc:name", "say.dcc.result");
  Node method = result.append_child("dcc:usedMethods").append_child("dcc:usedMethod");
  add_text(method, "dcc:name", "say.dcc.method");
  const calib::Phrase description = d.phrase(d.entry("method").text);
  add_text(method, "dcc:description", description.empty() ? kNotStated : description);
  add_software(result, "dcc:usedSoftware", d.entry("software"));
  add_equipments(d, result);
  add_conditions(d, result);
  Node results = result.append_child("dcc:results");
  add_figures(d, results, "say.certificate.as_found", "as_found");
  add_figures(d, results, "say.certificate.as_left", "as_left");
  const Json &checks = d.content.at("length_checks"), &budget = d.content.at("uncertainty_budget");
  if (!checks.empty()) {
    Node data = add_result(results, "say.dcc.scale");
    for (const Json& one : checks)
      add_quantity(data, of_ends("say.dcc.between", one), one.at("deviation"),
                   one.at("deviation_expanded"));
  }
  if (!budget.at("lines").empty()) {
    Node data = add_result(results, "say.dcc.budget");
    for (const Json& one : budget.at("lines"))
      add_quantity(data, d.phrase(one.at("source")), one.at("contribution"));
    add_quantity(data, "say.dcc.combined", budget.at("standard"));
  }
  if (d.content.contains("positioner"))
    add_positioner(d.content.at("positioner"), add_result(results, "say.report.positioner"));
  if (d.content.contains("linear_unit"))
    add_linear_unit(d.content.at("linear_unit"), add_result(results, "say.report.linear_unit"));
  Node data = add_result(results, "say.dcc.corrections");
  add_quantity(data, "say.dcc.touches", d.entry("touches"));
  for (const Json& one : d.content.at("parameters"))
    add_quantity(data, entry_at(one, "name").text, one.at("correction"), one.at("expanded"));
}

}  // namespace

std::string to_dcc(const CertificateData& d) {
  pugi::xml_document document;
  Node declaration = document.append_child(pugi::node_declaration);
  declaration.append_attribute("version") = "1.0";
  declaration.append_attribute("encoding") = "UTF-8";
  Node root = document.append_child("dcc:digitalCalibrationCertificate");
  root.append_attribute("xmlns:dcc") = "https://ptb.de/dcc";
  root.append_attribute("xmlns:si") = "https://ptb.de/si";
  root.append_attribute("xmlns:xsi") = "http://www.w3.org/2001/XMLSchema-instance";
  root.append_attribute("xsi:schemaLocation") =
      fmt::format("https://ptb.de/dcc https://ptb.de/dcc/v{}/dcc.xsd", kSchema).c_str();
  root.append_attribute("schemaVersion") = kSchema;
  add_administrative(d, root);
  add_measurement(d, root);
  std::ostringstream text;
  document.save(text, " ", pugi::format_indent, pugi::encoding_utf8);
  return text.str();
}

}  // namespace cellcal::daemon::certificate
