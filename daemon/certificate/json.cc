#include <nlohmann/json.hpp>

#include "daemon/certificate/certificate.h"

namespace cellcal::daemon::certificate {

using Json = nlohmann::ordered_json;

Json to_value(const Entry& entry) {
  Json value{{"text", entry.text}, {"from", entry.from}};
  if (entry.value) value["value"] = *entry.value;
  if (!entry.unit.empty()) value["unit"] = entry.unit;
  return value;
}

namespace {

constexpr const char* kCertificateFormat = "cellcal.certificate/1";

template <typename T, typename F>
Json list(const std::vector<T>& items, F to) {
  Json values = Json::array();
  for (const T& one : items) values.push_back(to(one));
  return values;
}

Json of_said(const Said& one) { return to_value(one.entry); }

Json of_artefact(const Artefact& one) {
  return {{"id", to_value(one.id)},
          {"kind", to_value(one.kind)},
          {"diameter", to_value(one.diameter)},
          {"expanded", to_value(one.expanded)},
          {"serial", to_value(one.serial)},
          {"certificate", to_value(one.certificate)},
          {"certificate_date", to_value(one.date)}};
}

Json of_length(const Length& one) {
  return {{"between", {to_value(one.from), to_value(one.to)}},
          {"length", to_value(one.length)},
          {"expanded", to_value(one.expanded)},
          {"certificate", to_value(one.certificate)},
          {"certificate_date", to_value(one.date)}};
}

Json of_length_check(const LengthCheck& one) {
  return {{"between", {to_value(one.from), to_value(one.to)}},
          {"certified", to_value(one.certified)},
          {"certified_expanded", to_value(one.certified_expanded)},
          {"measured", to_value(one.measured)},
          {"expanded", to_value(one.expanded)},
          {"deviation", to_value(one.deviation)},
          {"deviation_expanded", to_value(one.deviation_expanded)}};
}

Json of_budget_line(const BudgetLine& one) {
  return {{"source", calib::words(calib::Phrase(one.source))},
          {"distribution", "normal"},
          {"sigma", to_value(one.sigma)},
          {"sensitivity", to_value(one.sensitivity)},
          {"contribution", to_value(one.contribution)}};
}

Json of_figure(const Figure& one) {
  return {{"what", calib::words(calib::Phrase(one.what))},
          {"as_found", to_value(one.found)},
          {"as_left", to_value(one.left)}};
}

Json of_break(const Break& one) {
  return {{"what", one.resumed ? "resumed" : "interrupted"},
          {"utc", to_value(one.utc)},
          {"local", to_value(one.local)},
          {"phase", to_value(one.phase)},
          {"event", to_value(one.event)}};
}

/// An empty list means no interruptions.
Json of_breaks(const CertificateData& d) {
  if (d.dropped.stated()) return "not known";
  if (!d.changes_recorded) return "not recorded";
  return list(d.breaks, of_break);
}

Json of_parameter(const Parameter& one) {
  return {{"name", to_value(one.name)},
          {"nominal", to_value(one.nominal)},
          {"correction", to_value(one.correction)},
          {"expanded", to_value(one.expanded)},
          {"decided_by", to_value(one.decided_by)}};
}

Json of_positioner_axis(const PositionerAxis& one) {
  return {{"axis", to_value(one.name)},
          {"xyz", {to_value(one.x), to_value(one.y), to_value(one.z)}},
          {"direction",
           {to_value(one.direction_x), to_value(one.direction_y), to_value(one.direction_z)}},
          {"place_u95", to_value(one.place)},
          {"direction_u95", to_value(one.direction)}};
}

Json of_linear_unit(const LinearUnit& one) {
  Json rows = Json::array();
  for (const LinearUnit::Row& row : one.rows) {
    Json motion = Json::array(), u95 = Json::array();
    for (const Entry& entry : row.motion) motion.push_back(to_value(entry));
    for (const Entry& entry : row.u95) u95.push_back(to_value(entry));
    rows.push_back({{"position", to_value(row.position)},
                    {"motion", std::move(motion)},
                    {"u95", std::move(u95)}});
  }
  return {{"axis", to_value(one.name)},
          {"direction",
           {to_value(one.direction_x), to_value(one.direction_y), to_value(one.direction_z)}},
          {"direction_u95", to_value(one.direction)},
          {"scale", to_value(one.scale)},
          {"scale_u95", to_value(one.scale_u95)},
          {"at", std::move(rows)}};
}

Json of_file(const File& one) {
  return {
      {"role", to_value(one.role)}, {"name", to_value(one.name)}, {"sha256", to_value(one.sha256)}};
}

Json of_touch(const TouchRow& one) {
  return {{"number", to_value(one.number)},
          {"target", to_value(one.target)},
          {"set", to_value(one.set)},
          {"joints", list(one.joints, to_value)},
          {"readings", to_value(one.readings)},
          {"speed", to_value(one.speed)},
          {"temperature", to_value(one.temperature)},
          {"time", to_value(one.time)}};
}

Json of_decision(const Decision& rule) {
  if (!rule.stated) return nullptr;
  return {{"rule", "simple acceptance"},
          {"limit_by", rule.by_cell_file ? "cell file" : "default"},
          {"predicted", to_value(rule.predicted)},
          {"required", to_value(rule.required)},
          {"nominal", to_value(rule.nominal)},
          {"of_nominal", to_value(rule.of_nominal)},
          {"most_of_nominal", to_value(rule.most_of_nominal)}};
}

}  // namespace

std::string to_json(const CertificateData& d) {
  Json whole{{"format", kCertificateFormat}};
  whole["emulated"] = d.emulated.stated() ? to_value(d.emulated) : Json();
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
  for (const auto& [name, entry] : entries) whole[name] = to_value(*entry);
  whole["scope"] = d.workspace ? "workspace" : "near targets";
  whole["as_found_by"] = d.found_by ? to_value(*d.found_by) : Json();
  whole["earlier_not_comparable"] = d.earlier_not_comparable;
  whole["figures"] = list(d.figures, of_figure);
  whole["decision"] = of_decision(d.decision);
  whole["artefacts"] = list(d.artefacts, of_artefact);
  whole["lengths"] = list(d.lengths, of_length);
  whole["length_checks"] = list(d.length_checks, of_length_check);
  whole["uncertainty_budget"] = {{"lines", list(d.budget, of_budget_line)},
                                 {"standard", to_value(d.standard)},
                                 {"expanded", to_value(d.expanded)}};
  whole["pose_sheet"] = pose_sheet_json(d.pose_sheet);
  whole["not_identifiable"] = list(d.directions, of_said);
  whole["remarks"] = list(d.remarks, of_said);
  whole["breaks"] = of_breaks(d);
  whole["parameters"] = list(d.parameters, of_parameter);
  if (d.linear_unit) whole["linear_unit"] = of_linear_unit(*d.linear_unit);
  if (!d.positioner.empty()) whole["positioner"] = list(d.positioner, of_positioner_axis);
  whole["files"] = list(d.files, of_file);
  whole["joints"] = list(d.joint_names, to_value);
  whole["raw_touches"] = list(d.rows, of_touch);
  return whole.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace cellcal::daemon::certificate
