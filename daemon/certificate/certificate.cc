#include "daemon/certificate/certificate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/files/input_file.h"
#include "calib/model/units.h"
#include "calib/result/finding_phrase.h"
#include "daemon/certificate/sources.h"
#include "daemon/files/atomic_file.h"
#include "daemon/report/say.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon::certificate {

namespace {

using calib::kMmPerM;
using Json = nlohmann::ordered_json;
constexpr int kParameterDecimals = 4, kSmallDigits = 4, kDirectionDecimals = 6, kJointDecimals = 5,
              kTemperatureDecimals = 1, kSpeedDecimals = 2;

void refuse_withheld(const Sources& sources, const std::string& from) {
  const calib::Verdict& verdict = sources.calibration.verdict;
  if (verdict.publish()) return;
  std::string words = from + ": the result was withheld: no certificate";
  for (const calib::Finding& finding : verdict.findings)
    if (finding.severity == calib::Severity::kWithholds) words += "\n  " + calib::words(finding);
  throw Refused(Refused::Why::kWithheld, words);
}

/// Lengths, check touches and input files of an update belong to another session.
void refuse_update(const Sources& sources, const std::string& from) {
  if (!sources.calibration.update) return;
  throw Refused(
      Refused::Why::kUpdate,
      fmt::format("{}: an update, based on the calibration of {}. For a certificate run a full "
                  "session: 'cellcal run'",
                  from, printable(sources.calibration.update->stands_on)));
}

void add_identity(const Sources& s, const Issue& issue, CertificateData& data) {
  constexpr std::size_t kDigits = 12;
  const std::string sum = calib::sha256(s.record.calibration);
  const bool emulated = options_from_json(s.record.inputs.options).emulated;
  const bool one_tool = s.cell_json.at("tool").is_object();
  const Entry issued{issue.utc, "issue#at"}, began{s.record.started, "session#started"},
      ended{s.record.ended, "session#ended"}, method = s.text("calibration#/model/reason");
  const std::string number =
      fmt::format("{}{}-{}", emulated ? kEmulatedNumber : "", s.record.id, sum.substr(0, kDigits));
  data.content = {
      {"format", "cellcal.certificate/1"},
      {"emulated", nullptr},
      {"number", Entry{number, "number"}},
      {"session", Entry{std::to_string(s.record.id), "session#id"}},
      {"cell", Entry{s.record.inputs.cell_name, "session#cell_name"}},
      {"site", s.text("cell#/identity/site")},
      {"operator", s.text("cell#/identity/operator")},
      {"issued", issued},
      {"issued_local", local(issued)},
      {"issued_by", Entry{issue.by, "issue#by"}},
      {"issuing_software", Entry{issue.software, "issue#software"}},
      {"robot", s.text("robot#/name")},
      {"robot_serial", s.text("cell#/identity/robot_serial")},
      {"controller_serial", s.text("cell#/identity/controller_serial")},
      {"sensor", s.text("cell#/identity/sensor")},
      {"sensor_serial", s.text("cell#/identity/sensor_serial")},
      {"tool", one_tool ? Entry{"", "cell#/tool/id"} : s.text("cell#/tool/0/id")},
      {"tip_radius", s.number(one_tool ? "cell#/tool/tip_radius_mm" : "cell#/tool/0/tip_radius_mm",
                              "mm", kMmDecimals)},
      {"began", began},
      {"began_local", local(began)},
      {"ended", ended},
      {"ended_local", local(ended)},
      {"software", Entry{s.record.software, "session#software"}},
      {"method", method}};
  data.phrases[method.text] = calib::level_and_reason_phrase(s.calibration);
  if (emulated)
    data.content["emulated"] =
        Entry{data.said("say.certificate.emulated_cell"), "options#/emulated"};
}

void add_conditions(const Sources& s, CertificateData& data) {
  Entry lowest{"", "touches#lowest_c"}, highest{"", "touches#highest_c"};
  for (const calib::Touch& touch : s.touches) {
    if (!touch.temperature_c) continue;
    const double c = *touch.temperature_c;
    lowest = figure(std::min(lowest.value.value_or(c), c), "°C", kTemperatureDecimals, lowest.from);
    highest =
        figure(std::max(highest.value.value_or(c), c), "°C", kTemperatureDecimals, highest.from);
  }
  Json& content = data.content;
  content["touches"] = Entry{std::to_string(s.touches.size()), "touches#count",
                             static_cast<double>(s.touches.size())};
  content["lowest_temperature"] = lowest;
  content["highest_temperature"] = highest;
  content["poses"] = Entry();  // of the figures over the scope, where there are any
  content["raw_rows_dropped"] = Entry{s.record.dropped, "session#dropped"};
  content["rows_sha256"] = Entry{s.rows_sha256, "sha256(rows)"};
  content["calibration_sha256"] =
      Entry{calib::sha256(s.record.calibration), "sha256(session#calibration)"};
}

/// True if both ends were touched and located; unused lengths of the cell file do not concern this arm.
bool is_used(const Sources& s, std::size_t length) {
  for (const int end : {0, 1}) {
    const Entry id = s.text(fmt::format("cell#/length/{}/between/{}", length, end));
    if (std::ranges::find(s.calibration.targets, id.text, &calib::TargetResult::id) ==
        s.calibration.targets.end())
      return false;
  }
  return true;
}

void add_artefacts(const Sources& s, CertificateData& data) {
  Json artefacts = Json::array(), lengths = Json::array();
  for (std::size_t i = 0; i < s.size("cell#/target"); ++i) {
    const std::string at = fmt::format("cell#/target/{}/", i);
    const auto text = [&](const char* key) { return s.text(at + key); };
    artefacts.push_back({{"id", text("id")},
                         {"kind", text("kind")},
                         {"diameter", s.number(at + "diameter_mm", "mm", 4)},
                         {"expanded", s.expanded(at + "diameter_sigma_mm", "mm", 4)},
                         {"serial", text("serial")},
                         {"certificate", text("certificate")},
                         {"certificate_date", text("certificate_date")}});
  }
  for (std::size_t i = 0; i < s.size("cell#/length"); ++i) {
    if (!is_used(s, i)) continue;
    const std::string at = fmt::format("cell#/length/{}/", i);
    const auto text = [&](const char* key) { return s.text(at + key); };
    const Entry certificate = text("certificate");
    lengths.push_back({{"between", {text("between/0"), text("between/1")}},
                       {"length", s.number(at + "mm", "mm", 4)},
                       {"expanded", s.expanded(at + "sigma_mm", "mm", 4)},
                       {"certificate", certificate},
                       {"certificate_date", text("certificate_date")}});
    if (certificate.stated() && text("role").text != "check")
      data.scale_certificates.try_emplace(certificate.text, certificate);
  }
  data.content["artefacts"] = artefacts;
  data.content["lengths"] = lengths;
  data.scale = s.calibration.verdict.scale();
}

/// An empty list means no interruptions.
Json breaks(const Sources& s) {
  if (!s.record.dropped.empty()) return "not known";
  if (s.changes.empty()) return "not recorded";
  Json all = Json::array();
  bool begun = false;
  for (const Change& change : s.changes) {
    const bool begins = change.from == Phase::kIdle;
    const bool breaks = change.to == Phase::kRecovering || change.to == Phase::kAborted ||
                        change.to == Phase::kFailed;
    const bool resumed = (begins && begun) || (change.from == Phase::kWatchingTheLinks &&
                                               change.to == Phase::kReferencing);
    begun = begun || begins;
    if (!breaks && !resumed) continue;
    const auto column = [&](const char* name, const std::string& text) {
      return Entry{text, fmt::format("change#{}/{}", change.row, name)};
    };
    const Entry utc = column("time", change.time);
    all.push_back({{"what", breaks ? "interrupted" : "resumed"},
                   {"utc", utc},
                   {"local", local(utc)},
                   {"phase", column("from_phase", change.from_phase)},
                   {"event", column("event", change.event)}});
  }
  return all;
}

/// Sentences of the calibration's file.
void add_findings(const Sources& s, CertificateData& data) {
  const auto add = [&](const char* key, const std::string& list, const char* words,
                       const std::vector<calib::Phrase>& phrases) {
    Json all = Json::array();
    for (std::size_t i = 0; i < s.size(list); ++i) {
      const Entry entry = s.text(fmt::format("{}/{}{}", list, i, words));
      if (i < phrases.size()) data.phrases[entry.text] = phrases[i];
      all.push_back(entry);
    }
    data.content[key] = all;
  };
  std::vector<calib::Phrase> directions, remarks;
  for (const calib::UnidentifiableDirection& one : s.calibration.unidentifiable)
    directions.push_back(calib::phrase(s.calibration.cell, one));
  for (const calib::Finding& one : s.calibration.verdict.findings)
    remarks.push_back(calib::phrase(one));
  add("not_identifiable", "calibration#/unidentifiable", "/words", directions);
  add("remarks", "calibration#/verdict/reasons", "", remarks);
}

/// With which U has two significant digits, rounded.
int decimals_of_u(double u) {
  const std::string text = fmt::format("{:.1e}", u);
  return std::max(0, 1 - std::stoi(text.substr(text.find('e') + 1)));
}

Json parameters(const Sources& s) {
  Json all = Json::array();
  for (std::size_t i = 0; i < s.size("calibration#/parameters"); ++i) {
    const std::string at = fmt::format("calibration#/parameters/{}/", i);
    const std::string unit = s.text(at + "unit").text;
    const Entry expanded = s.expanded(at + "sigma", unit, kParameterDecimals);
    // Compliances and deflections are small in their units.
    const auto digits = [&](Entry entry) {
      if (entry.value && *entry.value != 0.0 && std::abs(*entry.value) < 1e-2)
        entry.text = report::significant(*entry.value, kSmallDigits);
      return entry;
    };
    const auto as_expanded = [&](Entry entry) {
      if (!entry.value || !(expanded.value.value_or(0.0) > 0.0)) return digits(entry);
      entry.text = report::fixed(*entry.value, decimals_of_u(*expanded.value));
      return entry;
    };
    all.push_back(
        {{"name", s.text(at + "name")},
         {"nominal", digits(s.number(at + "nominal", unit, kParameterDecimals))},
         {"correction", as_expanded(s.number(at + "correction", unit, kParameterDecimals))},
         {"expanded", as_expanded(expanded)},
         {"decided_by", s.text(at + "decided_by")}});
  }
  return all;
}

/// Components of a point or a direction.
Json three(const Sources& s, const std::string& at, const char* unit, int decimals) {
  const auto one = [&](int k) { return s.number(fmt::format("{}/{}", at, k), unit, decimals); };
  return {one(0), one(1), one(2)};
}

/// Axes as found: a point of each and its direction in the base frame, all axes at 0; bounds of 95 % across it
/// and of the direction.
Json positioner(const Sources& s) {
  Json axes = Json::array();
  for (std::size_t i = 0; i < s.size("calibration#/positioner"); ++i) {
    const std::string at = fmt::format("calibration#/positioner/{}/", i);
    axes.push_back({{"axis", s.text(at + "axis")},
                    {"xyz", three(s, at + "xyz_mm", "mm", kMmDecimals)},
                    {"direction", three(s, at + "direction", "", kDirectionDecimals)},
                    {"place_u95", s.number(at + "place_u95_mm", "mm", kMmDecimals)},
                    {"direction_u95", s.number(at + "direction_u95_mrad", "mrad", kMmDecimals)}});
  }
  return axes;
}

/// As found: direction of travel in the base frame, scale, and the motions of its carriage over its position
/// (shifts in both other directions, then roll, pitch and yaw), with bounds of 95 %.
Json linear_unit(const Sources& s) {
  constexpr int kScaleDecimals = 4;
  const std::string at = "calibration#/linear_unit/";
  const auto value = [&](const std::string& key, const char* unit, int decimals) {
    return s.number(at + key, unit, decimals);
  };
  Json places = Json::array();
  for (std::size_t i = 0; i < s.size(at + "at"); ++i) {
    Json motion = Json::array(), u95 = Json::array();
    for (int k = 0; k < calib::kGuideMotions; ++k) {
      const char* const unit = is_shift(calib::GuideMotion{k}) ? "mm" : "mrad";
      motion.push_back(value(fmt::format("at/{}/motion/{}", i, k), unit, kMmDecimals));
      u95.push_back(value(fmt::format("at/{}/u95/{}", i, k), unit, kMmDecimals));
    }
    places.push_back({{"position", value(fmt::format("at/{}/position_mm", i), "mm", 0)},
                      {"motion", motion},
                      {"u95", u95}});
  }
  return {{"axis", s.text(at + "axis")},
          {"direction", three(s, at + "direction", "", kDirectionDecimals)},
          {"direction_u95", value("direction_u95_mrad", "mrad", kMmDecimals)},
          {"scale", value("scale_mm_per_m", "mm/m", kScaleDecimals)},
          {"scale_u95", value("scale_u95_mm_per_m", "mm/m", kScaleDecimals)},
          {"at", places}};
}

Json files(const Sources& s) {
  Json all = Json::array();
  for (std::size_t i = 0; i < s.size("calibration#/inputs/files"); ++i) {
    const auto text = [&](const char* key) {
      return s.text(fmt::format("calibration#/inputs/files/{}/{}", i, key));
    };
    all.push_back({{"role", text("role")}, {"name", text("name")}, {"sha256", text("sha256")}});
  }
  return all;
}

Json joints(const Sources& s) {
  Json names = Json::array();
  const calib::Robot& robot = s.calibration.cell.robot;
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    Entry name = s.text(fmt::format("robot#/joint/{}/name", j));
    name.unit = unit_of(robot.joints[j]).name;
    names.push_back(name);
  }
  for (std::size_t j = 0; j < robot.positioner.size(); ++j)
    names.push_back(s.text(fmt::format("robot#/positioner/{}/name", j)));
  return names;
}

Json raw_touches(const Sources& s) {
  Json all = Json::array();
  const std::vector<bool> outlier = outliers_of(s);
  for (std::size_t i = 0; i < s.touches.size(); ++i) {
    const calib::Touch& touch = s.touches[i];
    const auto from = [&](const std::string& field) {
      return fmt::format("touch#{}/{}", i, field);
    };
    const auto number = [&](bool stated, double value, const char* unit, int decimals,
                            const std::string& field) {
      return stated ? raw_figure(value, unit, decimals, from(field)) : Entry{"", from(field)};
    };
    Json angles = Json::array();
    for (std::size_t j = 0; j < touch.joint_rad.size(); ++j) {
      const calib::JointUnit unit = unit_of(s.calibration.cell.robot.joints.at(j));
      angles.push_back(number(true, touch.joint_rad[j] * unit.per_si, unit.name, kJointDecimals,
                              fmt::format("joint_{}/{}", unit.name, j)));
    }
    for (std::size_t j = 0; j < touch.positioner_rad.size(); ++j)
      angles.push_back(number(true, touch.positioner_rad[j] * calib::kDegPerRad, "deg",
                              kJointDecimals, fmt::format("positioner_deg/{}", j)));
    all.push_back(
        {{"number", Entry{std::to_string(i + 1), from("number"), static_cast<double>(i + 1)}},
         {"target", Entry{touch.target, from("target")}},
         {"set", Entry{outlier[i] ? "left out" : to_string(touch.set), from("set")}},
         {"joints", angles},
         {"readings", number(touch.readings > 0, touch.readings, "", 0, "readings")},
         {"speed", number(touch.speed_m_s > 0.0, touch.speed_m_s * kMmPerM, "mm/s", kSpeedDecimals,
                          "speed_mm_s")},
         {"temperature", number(touch.temperature_c.has_value(), touch.temperature_c.value_or(0.0),
                                "°C", kTemperatureDecimals, "temperature_c")},
         {"time", Entry{touch.time, from("time")}}});
  }
  return all;
}

}  // namespace

void refuse_unless_reproduced(const Archive& archive, const std::string& from) {
  const Replay again = replay(archive, from);
  if (again.same()) return;
  throw Refused(
      Refused::Why::kNotReproduced,
      fmt::format(
          "{}: {}It gets no certificate: altered, or of another version. Issue it with the version that "
          "recorded it, from the journal that recorded it",
          from, in_words(again)));
}

CertificateData make_certificate(const Archive& archive, const std::string& from,
                                 const Issue& issue) {
  const Sources sources = read_sources(archive, from);
  refuse_withheld(sources, from);
  refuse_update(sources, from);
  CertificateData data;
  Json& content = data.content;  // in the order of the document
  add_identity(sources, issue, data);
  add_conditions(sources, data);
  add_figures(sources, data);
  content["decision"] = decision(sources);
  add_artefacts(sources, data);
  content["length_checks"] = length_checks(sources);
  add_budget(sources, data);
  content["pose_sheet"] = pose_sheet(sources);
  add_findings(sources, data);
  content["breaks"] = breaks(sources);
  content["parameters"] = parameters(sources);
  if (sources.calibration.linear_unit) content["linear_unit"] = linear_unit(sources);
  if (Json axes = positioner(sources); !axes.empty()) content["positioner"] = std::move(axes);
  content["files"] = files(sources);
  content["joints"] = joints(sources);
  content["raw_touches"] = raw_touches(sources);
  return data;
}

std::string to_json(const CertificateData& data) {
  return data.content.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace cellcal::daemon::certificate
