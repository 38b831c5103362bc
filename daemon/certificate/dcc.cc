// Digital Calibration Certificate, schema 3.1.2 of PTB (https://ptb.de/dcc), quantities as D-SI 2.1.0.

#include <fmt/format.h>

#include <algorithm>
#include <pugixml.hpp>
#include <sstream>

#include "daemon/certificate/certificate.h"

namespace cellcal::daemon::certificate {

namespace {

using Node = pugi::xml_node;

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

calib::Phrase said_of(const Said& one) {
  return one.phrase.empty() ? calib::Phrase(one.entry.text) : one.phrase;
}

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

void add_identification(Node list, const char* issuer, const char* name, const Entry& value) {
  if (!value.stated()) return;
  Node one = list.append_child("dcc:identification");
  add(one, "dcc:issuer", issuer);
  add(one, "dcc:value", value.text);
  add_text(one, "dcc:name", name);
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
  add(core, "dcc:uniqueIdentifier", d.number.text);
  Node identifications = core.append_child("dcc:identifications");
  add_identification(identifications, "calibrationLaboratory", "say.dcc.session", d.session);
  add_identification(identifications, "owner", "say.dcc.cell", d.cell);
  add_identification(identifications, "calibrationLaboratory", "say.dcc.sum", d.calibration_sha256);
  add(core, "dcc:beginPerformanceDate", day_of(d.began));
  add(core, "dcc:endPerformanceDate", day_of(d.ended));
  add(core, "dcc:performanceLocation", "customer");
}

void add_items(const CertificateData& d, Node administrative) {
  Node item = administrative.append_child("dcc:items").append_child("dcc:item");
  add_text(item, "dcc:name", "say.dcc.item");
  add_text(item.append_child("dcc:manufacturer"), "dcc:name", kNotStated);
  add(item, "dcc:model", text_or_not_stated(d.robot));
  Node identifications = item.append_child("dcc:identifications");
  add_identification(identifications, "manufacturer", "say.dcc.robot_serial", d.robot_serial);
  add_identification(identifications, "manufacturer", "say.dcc.controller_serial",
                     d.controller_serial);
  add_identification(identifications, "owner", "say.dcc.tool", d.tool);
  add_identification(identifications, "owner", "say.dcc.cell", d.cell);
  if (!identifications.first_child())
    add_identification(identifications, "calibrationLaboratory", "say.dcc.certificate", d.number);
}

void add_statement(Node statements, const calib::Phrase& text) {
  add_text(statements.append_child("dcc:statement"), "dcc:declaration", text);
}

/// Decision rule, scope, remarks, and what limits the result.
void add_statements(const CertificateData& d, Node administrative) {
  Node statements = administrative.append_child("dcc:statements");
  add_statement(statements, d.workspace ? "say.dcc.scope.workspace" : "say.dcc.scope.near");
  if (d.emulated.stated()) add_statement(statements, "say.dcc.emulated");
  if (d.decision.stated) {
    Node rule = statements.append_child("dcc:statement");
    add(rule, "dcc:convention", "simple acceptance");
    add_text(rule, "dcc:declaration",
             d.decision.by_cell_file ? "say.dcc.limit.cell_file" : "say.dcc.limit.default");
    add(rule, "dcc:conformity", "pass");
    Node data = rule.append_child("dcc:data");
    add_quantity(data, "say.dcc.predicted", d.decision.predicted);
    add_quantity(data, "say.dcc.permitted", d.decision.required);
  }
  for (const Said& one : d.directions)
    add_statement(statements, {"say.dcc.not_identifiable", {{"words", said_of(one)}}});
  for (const Said& one : d.remarks) add_statement(statements, said_of(one));
}

void add_administrative(const CertificateData& d, Node root) {
  Node administrative = root.append_child("dcc:administrativeData");
  add_software(administrative, "dcc:dccSoftware", d.issuing_software);
  add_core_data(d, administrative);
  add_items(d, administrative);
  add_contact(administrative.append_child("dcc:calibrationLaboratory"), "dcc:contact", d.issued_by,
              d.site);
  Node person = administrative.append_child("dcc:respPersons").append_child("dcc:respPerson");
  add_text(person.append_child("dcc:person"), "dcc:name",
           or_not_stated(d.operator_name.stated() ? d.operator_name : d.issued_by));
  add(person, "dcc:mainSigner", "true");
  add_contact(administrative, "dcc:customer", d.site, d.site);
  add_statements(d, administrative);
}

Node add_equipment(Node list, const calib::Phrase& name, const Entry& serial,
                   const Entry& certificate, const Entry& date) {
  Node one = list.append_child("dcc:measuringEquipment");
  add_text(one, "dcc:name", name);
  if (!serial.stated() && !certificate.stated()) return one;
  Node identifications = one.append_child("dcc:identifications");
  add_identification(identifications, "manufacturer", "say.dcc.serial", serial);
  add_identification(identifications, "other", "say.dcc.certificate", certificate);
  add_identification(identifications, "other", "say.dcc.certificate_date", date);
  return one;
}

void add_equipment_quantity(Node equipment, const char* name, const Entry& value,
                            const Entry& expanded) {
  if (!value.stated()) return;
  Node quantity = equipment.append_child("dcc:measuringEquipmentQuantities")
                      .append_child("dcc:measuringEquipmentQuantity");
  add_text(quantity, "dcc:name", name);
  add_value(quantity, value, expanded);
}

/// Kind of the cell file as a word of the language.
calib::Phrase kind_of(const Entry& kind) {
  const std::string id = "say.report.kind." + kind.text;
  return calib::sentence_of(id) ? calib::Phrase(id) : or_not_stated(kind);
}

void add_equipments(const CertificateData& d, Node result) {
  Node list = result.append_child("dcc:measuringEquipments");
  for (const Artefact& one : d.artefacts)
    add_equipment_quantity(
        add_equipment(list,
                      {"say.dcc.artefact", {{"kind", kind_of(one.kind)}, {"name", one.id.text}}},
                      one.serial, one.certificate, one.date),
        "say.dcc.diameter", one.diameter, one.expanded);
  for (const Length& one : d.lengths)
    add_equipment_quantity(
        add_equipment(list, {"say.dcc.length", {{"from", one.from.text}, {"to", one.to.text}}}, {},
                      one.certificate, one.date),
        "say.dcc.distance", one.length, one.expanded);
  if (d.sensor.stated() || d.artefacts.empty())
    add_equipment(list, {"say.dcc.sensor", {{"name", or_not_stated(d.sensor)}}}, d.sensor_serial,
                  {}, {});
}

void add_conditions(const CertificateData& d, Node result) {
  if (!d.lowest_c.stated()) return;
  Node condition =
      result.append_child("dcc:influenceConditions").append_child("dcc:influenceCondition");
  add_text(condition, "dcc:name", "say.dcc.temperature");
  Node data = condition.append_child("dcc:data");
  add_quantity(data, "say.dcc.lowest", d.lowest_c);
  add_quantity(data, "say.dcc.highest", d.highest_c);
}

Node add_result(Node results, const char* name) {
  Node result = results.append_child("dcc:result");
  add_text(result, "dcc:name", name);
  return result.append_child("dcc:data");
}

void add_figures(const CertificateData& d, Node results, const char* name, Entry Figure::*of) {
  if (std::ranges::none_of(d.figures, [of](const Figure& one) { return (one.*of).stated(); }))
    return;
  Node data = add_result(results, name);
  for (const Figure& one : d.figures) add_quantity(data, one.what, one.*of);
}

constexpr std::array kPointIds{"say.dcc.positioner.x", "say.dcc.positioner.y",
                               "say.dcc.positioner.z"},
    kDirectionIds{"say.dcc.positioner.direction_x", "say.dcc.positioner.direction_y",
                  "say.dcc.positioner.direction_z"};

void add_three(Node data, const std::array<const char*, 3>& ids, const Entry& axis,
               const std::array<Entry, 3>& values) {
  for (std::size_t k = 0; k < values.size(); ++k)
    add_quantity(data, {ids[k], {{"axis", axis.text}}}, values[k]);
}

/// Bounds are of distances and angles across the axis, not of components.
void add_positioner(const CertificateData& d, Node data) {
  for (const PositionerAxis& one : d.positioner) {
    const auto add_one = [&](const char* id, const Entry& value) {
      add_quantity(data, {id, {{"axis", one.name.text}}}, value);
    };
    add_three(data, kPointIds, one.name, one.xyz);
    add_three(data, kDirectionIds, one.name, one.along);
    add_one("say.dcc.positioner.place", one.place);
    add_one("say.dcc.positioner.direction", one.direction);
  }
}

void add_linear_unit(const LinearUnit& unit, Node data) {
  const auto add_one = [&](const char* id, const Entry& value, const Entry& bound = {}) {
    add_quantity(data, {id, {{"axis", unit.name.text}}}, value, bound);
  };
  add_three(data, kDirectionIds, unit.name, unit.along);
  add_one("say.dcc.positioner.direction", unit.direction);
  add_one("say.dcc.linear_unit.scale", unit.scale, unit.scale_u95);
  constexpr const char* kMotions[] = {"along", "across", "above", "roll", "pitch", "yaw"};
  for (const LinearUnit::Row& row : unit.rows)
    for (std::size_t k = 0; k < row.motion.size(); ++k)
      add_quantity(data,
                   {std::string("say.dcc.linear_unit.") + kMotions[k],
                    {{"axis", unit.name.text}, {"at", row.position.text}}},
                   row.motion[k], row.u95[k]);
}

void add_measurement(const CertificateData& d, Node root) {
  Node result = root.append_child("dcc:measurementResults").append_child("dcc:measurementResult");
  add_text(result, "dcc:name", "say.dcc.result");
  Node method = result.append_child("dcc:usedMethods").append_child("dcc:usedMethod");
  add_text(method, "dcc:name", "say.dcc.method");
  add_text(method, "dcc:description",
           d.method_said.empty() ? or_not_stated(d.method) : d.method_said);
  add_software(result, "dcc:usedSoftware", d.software);
  add_equipments(d, result);
  add_conditions(d, result);
  Node results = result.append_child("dcc:results");
  add_figures(d, results, "say.certificate.as_found", &Figure::found);
  add_figures(d, results, "say.certificate.as_left", &Figure::left);
  if (!d.length_checks.empty()) {
    Node checks = add_result(results, "say.dcc.scale");
    for (const LengthCheck& one : d.length_checks)
      add_quantity(checks, {"say.dcc.between", {{"from", one.from.text}, {"to", one.to.text}}},
                   one.deviation, one.deviation_expanded);
  }
  if (!d.budget.empty()) {
    Node budget = add_result(results, "say.dcc.budget");
    for (const BudgetLine& one : d.budget) add_quantity(budget, one.source, one.contribution);
    add_quantity(budget, "say.dcc.combined", d.standard);
  }
  if (!d.positioner.empty()) add_positioner(d, add_result(results, "say.report.positioner"));
  if (d.linear_unit) add_linear_unit(*d.linear_unit, add_result(results, "say.report.linear_unit"));
  Node data = add_result(results, "say.dcc.corrections");
  add_quantity(data, "say.dcc.touches", d.touches);
  for (const Parameter& one : d.parameters)
    add_quantity(data, one.name.text, one.correction, one.expanded);
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
