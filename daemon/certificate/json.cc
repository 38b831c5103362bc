#include <nlohmann/json.hpp>

#include "daemon/certificate/certificate.h"

namespace cellcal::daemon::certificate {

using Json = nlohmann::ordered_json;

void to_json(Json& value, const Entry& entry) {
  value = {{"text", entry.text}, {"from", entry.from}};
  if (entry.value) value["value"] = *entry.value;
  if (!entry.unit.empty()) value["unit"] = entry.unit;
}

// Found by nlohmann/json, also for vectors of them.

static void to_json(Json& value, const Said& one) { value = one.entry; }

static void to_json(Json& value, const Artefact& one) {
  value = {{"id", one.id},
           {"kind", one.kind},
           {"diameter", one.diameter},
           {"expanded", one.expanded},
           {"serial", one.serial},
           {"certificate", one.certificate},
           {"certificate_date", one.date}};
}

static void to_json(Json& value, const Length& one) {
  value = {{"between", {one.from, one.to}},
           {"length", one.length},
           {"expanded", one.expanded},
           {"certificate", one.certificate},
           {"certificate_date", one.date}};
}

static void to_json(Json& value, const LengthCheck& one) {
  value = {{"between", {one.from, one.to}},
           {"certified", one.certified},
           {"certified_expanded", one.certified_expanded},
           {"measured", one.measured},
           {"expanded", one.expanded},
           {"deviation", one.deviation},
           {"deviation_expanded", one.deviation_expanded}};
}

static void to_json(Json& value, const BudgetLine& one) {
  value = {{"source", calib::words(calib::Phrase(one.source))},
           {"distribution", "normal"},
           {"sigma", one.sigma},
           {"sensitivity", one.sensitivity},
           {"contribution", one.contribution}};
}

static void to_json(Json& value, const Figure& one) {
  value = {{"what", calib::words(calib::Phrase(one.what))},
           {"as_found", one.found},
           {"as_left", one.left}};
}

static void to_json(Json& value, const Break& one) {
  value = {{"what", one.resumed ? "resumed" : "interrupted"},
           {"utc", one.utc},
           {"local", one.local},
           {"phase", one.phase},
           {"event", one.event}};
}

/// An empty list means no interruptions.
static Json of_breaks(const CertificateData& d) {
  if (d.dropped.stated()) return "not known";
  if (!d.changes_recorded) return "not recorded";
  return d.breaks;
}

static void to_json(Json& value, const Parameter& one) {
  value = {{"name", one.name},
           {"nominal", one.nominal},
           {"correction", one.correction},
           {"expanded", one.expanded},
           {"decided_by", one.decided_by}};
}

static void to_json(Json& value, const PositionerAxis& one) {
  value = {{"axis", one.name},
           {"xyz", one.xyz},
           {"direction", one.along},
           {"place_u95", one.place},
           {"direction_u95", one.direction}};
}

static void to_json(Json& value, const LinearUnit::Row& one) {
  value = {{"position", one.position}, {"motion", one.motion}, {"u95", one.u95}};
}

static void to_json(Json& value, const LinearUnit& one) {
  value = {{"axis", one.name},   {"direction", one.along},     {"direction_u95", one.direction},
           {"scale", one.scale}, {"scale_u95", one.scale_u95}, {"at", one.rows}};
}

static void to_json(Json& value, const File& one) {
  value = {{"role", one.role}, {"name", one.name}, {"sha256", one.sha256}};
}

static void to_json(Json& value, const TouchRow& one) {
  value = {{"number", one.number},           {"target", one.target},     {"set", one.set},
           {"joints", one.joints},           {"readings", one.readings}, {"speed", one.speed},
           {"temperature", one.temperature}, {"time", one.time}};
}

static Json of_decision(const Decision& rule) {
  if (!rule.stated) return nullptr;
  return {{"rule", "simple acceptance"},
          {"limit_by", rule.by_cell_file ? "cell file" : "default"},
          {"predicted", rule.predicted},
          {"required", rule.required},
          {"nominal", rule.nominal},
          {"of_nominal", rule.of_nominal},
          {"most_of_nominal", rule.most_of_nominal}};
}

std::string to_json(const CertificateData& d) {
  Json whole{{"format", "cellcal.certificate/1"}};
  whole["emulated"] = d.emulated.stated() ? Json(d.emulated) : Json();
  const std::pair<const char*, const Entry*> entries[] = {
      {"number", &d.number},
      {"session", &d.session},
      {"cell", &d.cell},
      {"site", &d.site},
      {"operator", &d.operator_name},
      {"issued", &d.issued},
      {"issued_local", &d.issued_local},
      {"issued_by", &d.issued_by},
      {"issuing_software", &d.issuing_software},
      {"robot", &d.robot},
      {"robot_serial", &d.robot_serial},
      {"controller_serial", &d.controller_serial},
      {"sensor", &d.sensor},
      {"sensor_serial", &d.sensor_serial},
      {"tool", &d.tool},
      {"tip_radius", &d.tip_radius},
      {"began", &d.began},
      {"began_local", &d.began_local},
      {"ended", &d.ended},
      {"ended_local", &d.ended_local},
      {"software", &d.software},
      {"method", &d.method},
      {"touches", &d.touches},
      {"lowest_temperature", &d.lowest_c},
      {"highest_temperature", &d.highest_c},
      {"poses", &d.poses},
      {"raw_rows_dropped", &d.dropped},
      {"rows_sha256", &d.rows_sha256},
      {"calibration_sha256", &d.calibration_sha256}};
  for (const auto& [name, entry] : entries) whole[name] = *entry;
  whole["scope"] = d.workspace ? "workspace" : "near targets";
  whole["as_found_by"] = d.found_by ? Json(*d.found_by) : Json();
  whole["earlier_not_comparable"] = d.earlier_not_comparable;
  whole["figures"] = d.figures;
  whole["decision"] = of_decision(d.decision);
  whole["artefacts"] = d.artefacts;
  whole["lengths"] = d.lengths;
  whole["length_checks"] = d.length_checks;
  whole["uncertainty_budget"] = {
      {"lines", d.budget}, {"standard", d.standard}, {"expanded", d.expanded}};
  whole["pose_sheet"] = pose_sheet_json(d.pose_sheet);
  whole["not_identifiable"] = d.directions;
  whole["remarks"] = d.remarks;
  whole["breaks"] = of_breaks(d);
  whole["parameters"] = d.parameters;
  if (d.linear_unit) whole["linear_unit"] = *d.linear_unit;
  if (!d.positioner.empty()) whole["positioner"] = d.positioner;
  whole["files"] = d.files;
  whole["joints"] = d.joint_names;
  whole["raw_touches"] = d.rows;
  return whole.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace cellcal::daemon::certificate
