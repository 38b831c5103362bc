#include "daemon/certificate/certificate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/estimate/region.h"
#include "calib/files/input_file.h"
#include "calib/model/enum_table.h"
#include "calib/model/units.h"
#include "calib/result/finding_phrase.h"
#include "calib/verdict/change.h"
#include "calib/verdict/verdict.h"
#include "daemon/files/atomic_file.h"
#include "daemon/report/plan_picture.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon::certificate {

namespace {

using calib::kMmPerM;
constexpr int kMmDecimals = 3, kParameterDecimals = 4, kSmallDigits = 4, kDirectionDecimals = 6,
              kJointDecimals = 5, kTemperatureDecimals = 1, kSpeedDecimals = 2;
constexpr const char* kCalibration = "calibration";

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
  const std::string sum = calib::sha256(s.record.calibration);
  constexpr std::size_t kDigits = 12;
  if (options_from_json(s.record.inputs.options).emulated)
    data.emulated = {"emulated cell", "options#/emulated"};
  data.number = {fmt::format("{}{}-{}", data.emulated.stated() ? kEmulatedNumber : "", s.record.id,
                             sum.substr(0, kDigits)),
                 "number"};
  data.session = s.session("id", std::to_string(s.record.id));
  data.cell = s.session("cell_name", s.record.inputs.cell_name);
  data.site = s.text("cell", "/identity/site");
  data.operator_name = s.text("cell", "/identity/operator");
  data.issued = {issue.utc, "issue#at"};
  data.issued_local = local(data.issued);
  data.issued_by = {issue.by, "issue#by"};
  data.issuing_software = {issue.software, "issue#software"};
  data.robot = s.text("robot", "/name");
  data.robot_serial = s.text("cell", "/identity/robot_serial");
  data.controller_serial = s.text("cell", "/identity/controller_serial");
  data.sensor = s.text("cell", "/identity/sensor");
  data.sensor_serial = s.text("cell", "/identity/sensor_serial");
  const bool one = s.cell_json.at("tool").is_object();
  data.tool = one ? Entry{"", "cell#/tool/id"} : s.text("cell", "/tool/0/id");
  data.tip_radius =
      s.number("cell", one ? "/tool/tip_radius_mm" : "/tool/0/tip_radius_mm", "mm", kMmDecimals);
  data.began = s.session("started", s.record.started);
  data.began_local = local(data.began);
  data.ended = s.session("ended", s.record.ended);
  data.ended_local = local(data.ended);
  data.software = s.session("software", s.record.software);
  data.method = s.text(kCalibration, "/model/reason");
  data.method_said = calib::level_and_reason_phrase(s.calibration);
}

/// True if both ends were touched and located; unused lengths of the cell file do not concern this arm.
bool is_used(const Sources& s, std::size_t length) {
  for (const int end : {0, 1}) {
    const Entry id = s.text("cell", fmt::format("/length/{}/between/{}", length, end));
    if (std::ranges::find(s.calibration.targets, id.text, &calib::TargetResult::id) ==
        s.calibration.targets.end())
      return false;
  }
  return true;
}

void add_artefacts(const Sources& s, CertificateData& data) {
  for (std::size_t i = 0; i < s.size("cell", "/target"); ++i) {
    const std::string at = fmt::format("/target/{}/", i);
    const auto text = [&](const char* key) { return s.text("cell", at + key); };
    data.artefacts.push_back({text("id"), text("kind"),
                              s.number("cell", at + "diameter_mm", "mm", 4),
                              s.expanded("cell", at + "diameter_sigma_mm", "mm", 4), text("serial"),
                              text("certificate"), text("certificate_date")});
  }
  for (std::size_t i = 0; i < s.size("cell", "/length"); ++i) {
    if (!is_used(s, i)) continue;
    const std::string at = fmt::format("/length/{}/", i);
    const auto text = [&](const char* key) { return s.text("cell", at + key); };
    data.lengths.push_back({text("between/0"), text("between/1"),
                            s.number("cell", at + "mm", "mm", 4),
                            s.expanded("cell", at + "sigma_mm", "mm", 4), text("certificate"),
                            text("certificate_date"), text("role").text == "check"});
  }
  data.scale = s.calibration.verdict.scale();
}

/// Value computed from two others of the calibration.
Entry of_two(const Sources& s, const char* function, const std::string& a, const std::string& b,
             const std::string& unit, int decimals, double (*compute)(double, double)) {
  const Entry one = s.number(kCalibration, a, unit, decimals),
              other = s.number(kCalibration, b, unit, decimals);
  const std::string from = fmt::format("{}({},{})", function, one.from, other.from);
  if (!one.value || !other.value) return {"", from};
  return figure(compute(*one.value, *other.value), unit, decimals, from);
}

void add_length_checks(const Sources& s, CertificateData& data) {
  constexpr int kDecimals = 4;
  for (std::size_t i = 0; i < s.size(kCalibration, "/lengths"); ++i) {
    const std::string at = fmt::format("/lengths/{}/", i);
    if (s.text(kCalibration, at + "role").text != "check") continue;
    const auto value = [&](const char* key) {
      return s.number(kCalibration, at + key, "mm", kDecimals);
    };
    const auto twice = [&](const char* key) {
      return s.expanded(kCalibration, at + key, "mm", kDecimals);
    };
    data.length_checks.push_back(
        {s.text(kCalibration, at + "between/0"), s.text(kCalibration, at + "between/1"),
         value("certified_mm"), twice("certified_sigma_mm"), value("by_others_mm"),
         twice("by_others_sigma_mm"),
         of_two(s, "difference", at + "by_others_mm", at + "certified_mm", "mm", kDecimals,
                [](double a, double b) { return a - b; }),
         of_two(s, "k*hypot", at + "by_others_sigma_mm", at + "certified_sigma_mm", "mm", kDecimals,
                [](double a, double b) { return kCoverage * std::hypot(a, b); })});
  }
}

void add_budget(const Sources& s, CertificateData& data) {
  constexpr int kDecimals = 4;
  const auto& lines = s.calibration.uncertainty;
  const char* key = data.workspace ? "m3_mm" : "m2_mm";
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::string at = fmt::format("/uncertainty/{}/", i);
    const std::string unit = calib::unit_of(lines[i].source).name;
    BudgetLine line{"say.certificate.source." + std::string(own_name(lines[i].source)), {}, {}, {}};
    line.contribution = s.number(kCalibration, at + key, "mm", kDecimals);
    if (lines[i].sigma > 0.0) {
      line.sigma = s.number(kCalibration, at + "sigma", unit, kDecimals);
      line.sensitivity = of_two(s, "ratio", at + key, at + "sigma", "mm/" + unit, kDecimals,
                                [](double a, double b) { return a / b; });
    }
    data.budget.push_back(line);
  }
}

Entry mm(double metres, const std::string& from) {
  return figure(metres * kMmPerM, "mm", kMmDecimals, from);
}

/// Touches rejected by the fit or among the check touches.
std::vector<bool> outliers_of(const Sources& s) {
  std::vector<bool> outlier(s.touches.size());
  const auto leave_out = [&](std::size_t touch) {
    if (touch < outlier.size()) outlier[touch] = true;
  };
  for (const calib::Outlier& one : s.calibration.outliers) leave_out(one.touch);
  for (const calib::TouchResidual& one : s.calibration.residuals)
    if (one.outlier) leave_out(one.touch);
  // A file contains no residuals of single touches; outliers among the check touches are listed in a finding.
  for (const calib::Finding& finding : s.calibration.verdict.findings) {
    if (finding.kind != calib::FindingKind::kGrossCheckTouches) continue;
    for (const calib::FindingPart& part : finding.parts)
      if (part.about.touch) leave_out(*part.about.touch);
  }
  return outlier;
}

struct SummaryWords {
  const char *mean, *largest, *rms;
};

/// Residuals by the earlier calibration or, without one, by the nominal geometry (`before`); not stated
/// without touches.
void add_summary(const Sources& s, const SummaryWords& words, const char* part,
                 const calib::ResidualSummary* found, const std::string& before,
                 const std::string& after, CertificateData& data) {
  // a file of an earlier version states no count
  const double count = found != nullptr
                           ? found->count
                           : s.number(kCalibration, before + "count", "", 0).value.value_or(1.0);
  const auto line = [&](const char* what, const char* key, double found_m) {
    data.figures.push_back({what,
                            count <= 0.0 ? Entry{}
                            : found != nullptr
                                ? mm(found_m, fmt::format("found#{}/{}", part, key))
                                : s.number(kCalibration, before + key, "mm", kMmDecimals),
                            s.number(kCalibration, after + key, "mm", kMmDecimals)});
  };
  const calib::ResidualSummary none;
  const calib::ResidualSummary& of = found != nullptr ? *found : none;
  line(words.mean, "mean_mm", of.mean_m);
  line(words.largest, "max_mm", of.max_m);
  line(words.rms, "rms_mm", of.rms_m);
}

/// The previous model of the arm, and its residuals in the touches.
std::optional<calib::FoundResiduals> add_found_by(const Sources& s, CertificateData& data) {
  if (!s.compared) return std::nullopt;
  std::optional<calib::FoundResiduals> found;
  if (s.earlier && calib::same_nominal(s.earlier->cell, s.calibration.cell))
    found = calib::found_residuals(*s.earlier, s.touches, outliers_of(s));
  data.earlier_not_comparable = !found;
  if (found) data.found_by = Entry{s.compared->words, "compared#words"};
  return found;
}

void add_figures(const Sources& s, CertificateData& data) {
  data.workspace = s.calibration.verdict.workspace;
  const auto found = add_found_by(s, data);
  add_summary(s,
              {"say.certificate.tip.fitted.mean", "say.certificate.tip.fitted.largest",
               "say.certificate.tip.fitted.rms"},
              "fit", found ? &found->fit : nullptr, "/residuals/before/", "/residuals/after/",
              data);
  if (s.calibration.check.count > 0)
    add_summary(s,
                {"say.certificate.tip.check.mean", "say.certificate.tip.check.largest",
                 "say.certificate.tip.check.rms"},
                "check", found ? &found->check : nullptr, "/residuals/check_before/",
                "/residuals/check/", data);
  const std::string predicted = data.workspace ? "/predicted/m3_mm" : "/predicted/m2_mm";
  const auto scope = calib::apart_in_scope(data.found_by ? &*s.earlier : nullptr, s.calibration,
                                           s.touches, data.workspace);
  const Entry left = s.number(kCalibration, predicted, "mm", kMmDecimals);
  const double rms_mm = left.value.value_or(0.0) / calib::kMeanOverRms;
  data.standard = figure(rms_mm, "mm", kMmDecimals + 1, "rms(calibration#" + predicted + ")");
  const Entry expanded = data.expanded =
      figure(kCoverage * rms_mm, "mm", kMmDecimals, "k*rms(calibration#" + predicted + ")");
  if (!scope) {
    data.figures.push_back({"say.certificate.tcp.mean", {}, left});
    data.figures.push_back({"say.certificate.u", {}, expanded});
    return;
  }
  data.poses = {std::to_string(scope->poses), "scope#poses", scope->poses};
  const std::string nominal = data.workspace ? "/predicted/nominal_m3" : "/predicted/nominal_m2";
  // For the nominal arm the calibration states it; an earlier version has another value there.
  const bool stated = !data.found_by && s.calibration.nominal_workspace_u_m > 0.0;
  const Entry found_mean = stated ? s.number(kCalibration, nominal + "_mm", "mm", kMmDecimals)
                                  : mm(scope->mean_apart_m, "scope#mean_mm");
  const Entry found_u =
      stated ? s.number(kCalibration, nominal + "_u_mm", "mm", kMmDecimals) : Entry{};
  data.figures.push_back({"say.certificate.tcp.mean", found_mean, left});
  data.figures.push_back(
      {"say.certificate.tcp.largest", mm(scope->max_apart_m, "scope#max_mm"), {}});
  if (stated) data.figures.push_back({"say.certificate.u_of_mean", found_u, {}});
  data.figures.push_back({"say.certificate.u", expanded, expanded});
  data.figures.push_back(
      {"say.certificate.bound.mean", {}, mm(scope->mean_u95_m, "scope#u95_mean_mm")});
  data.figures.push_back(
      {"say.certificate.bound.largest", {}, mm(scope->max_u95_m, "scope#u95_max_mm")});
}

void add_conditions(const Sources& s, CertificateData& data) {
  data.touches = {std::to_string(s.touches.size()), "touches#count",
                  static_cast<double>(s.touches.size())};
  std::optional<double> lowest, highest;
  for (const calib::Touch& touch : s.touches) {
    if (!touch.temperature_c) continue;
    lowest = std::min(lowest.value_or(*touch.temperature_c), *touch.temperature_c);
    highest = std::max(highest.value_or(*touch.temperature_c), *touch.temperature_c);
  }
  data.lowest_c.from = "touches#lowest_c";
  data.highest_c.from = "touches#highest_c";
  if (lowest) {
    data.lowest_c = figure(*lowest, "°C", kTemperatureDecimals, data.lowest_c.from);
    data.highest_c = figure(*highest, "°C", kTemperatureDecimals, data.highest_c.from);
  }
  data.dropped = s.session("dropped", s.record.dropped);
  data.changes_recorded = !s.changes.empty();
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
    data.breaks.push_back({!breaks, utc, local(utc), column("from_phase", change.from_phase),
                           column("event", change.event)});
  }
}

void add_findings(const Sources& s, CertificateData& data) {
  const auto& directions = s.calibration.unidentifiable;
  for (std::size_t i = 0; i < s.size(kCalibration, "/unidentifiable"); ++i)
    data.directions.push_back({s.text(kCalibration, fmt::format("/unidentifiable/{}/words", i)),
                               i < directions.size()
                                   ? calib::phrase(s.calibration.cell, directions[i])
                                   : calib::Phrase()});
  const auto& findings = s.calibration.verdict.findings;
  for (std::size_t i = 0; i < s.size(kCalibration, "/verdict/reasons"); ++i)
    data.remarks.push_back({s.text(kCalibration, fmt::format("/verdict/reasons/{}", i)),
                            i < findings.size() ? calib::phrase(findings[i]) : calib::Phrase()});
}

/// With which U has two significant digits, rounded.
int decimals_of_u(double u) {
  const std::string text = fmt::format("{:.1e}", u);
  return std::max(0, 1 - std::stoi(text.substr(text.find('e') + 1)));
}

void add_parameters(const Sources& s, CertificateData& data) {
  for (std::size_t i = 0; i < s.size(kCalibration, "/parameters"); ++i) {
    const std::string at = fmt::format("/parameters/{}/", i);
    const std::string unit = s.text(kCalibration, at + "unit").text;
    const Entry expanded = s.expanded(kCalibration, at + "sigma", unit, kParameterDecimals);
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
    data.parameters.push_back(
        {s.text(kCalibration, at + "name"),
         digits(s.number(kCalibration, at + "nominal", unit, kParameterDecimals)),
         as_expanded(s.number(kCalibration, at + "correction", unit, kParameterDecimals)),
         as_expanded(expanded), s.text(kCalibration, at + "decided_by")});
  }
}

/// Components of a point or a direction.
std::array<Entry, 3> three(const Sources& s, const std::string& at, const char* unit,
                           int decimals) {
  const auto one = [&](int k) {
    return s.number(kCalibration, fmt::format("{}/{}", at, k), unit, decimals);
  };
  return {one(0), one(1), one(2)};
}

void add_positioner(const Sources& s, CertificateData& data) {
  for (std::size_t i = 0; i < s.size(kCalibration, "/positioner"); ++i) {
    const std::string at = fmt::format("/positioner/{}/", i);
    data.positioner.push_back(
        {s.text(kCalibration, at + "axis"), three(s, at + "xyz_mm", "mm", kMmDecimals),
         three(s, at + "direction", "", kDirectionDecimals),
         s.number(kCalibration, at + "place_u95_mm", "mm", kMmDecimals),
         s.number(kCalibration, at + "direction_u95_mrad", "mrad", kMmDecimals)});
  }
}

void add_linear_unit(const Sources& s, CertificateData& data) {
  if (!s.calibration.linear_unit) return;
  constexpr int kScaleDecimals = 4;
  const std::string at = "/linear_unit/";
  const auto value = [&](const std::string& key, const char* unit, int decimals) {
    return s.number(kCalibration, at + key, unit, decimals);
  };
  LinearUnit& unit =
      data.linear_unit.emplace(LinearUnit{s.text(kCalibration, at + "axis"),
                                          three(s, at + "direction", "", kDirectionDecimals),
                                          value("direction_u95_mrad", "mrad", kMmDecimals),
                                          value("scale_mm_per_m", "mm/m", kScaleDecimals),
                                          value("scale_u95_mm_per_m", "mm/m", kScaleDecimals),
                                          {}});
  for (std::size_t i = 0; i < s.size(kCalibration, at + "at"); ++i) {
    LinearUnit::Row& row = unit.rows.emplace_back();
    row.position = value(fmt::format("at/{}/position_mm", i), "mm", 0);
    for (std::size_t k = 0; k < row.motion.size(); ++k) {
      const char* const one = is_shift(calib::GuideMotion{static_cast<int>(k)}) ? "mm" : "mrad";
      row.motion[k] = value(fmt::format("at/{}/motion/{}", i, k), one, kMmDecimals);
      row.u95[k] = value(fmt::format("at/{}/u95/{}", i, k), one, kMmDecimals);
    }
  }
}

void add_files(const Sources& s, CertificateData& data) {
  for (std::size_t i = 0; i < s.size(kCalibration, "/inputs/files"); ++i) {
    const auto text = [&](const char* key) {
      return s.text(kCalibration, fmt::format("/inputs/files/{}/{}", i, key));
    };
    data.files.push_back({text("role"), text("name"), text("sha256")});
  }
  data.rows_sha256 = {s.rows_sha256, "sha256(rows)"};
  data.calibration_sha256 = {calib::sha256(s.record.calibration), "sha256(session#calibration)"};
}

void add_touches(const Sources& s, CertificateData& data) {
  const auto& joints = s.calibration.cell.robot.joints;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    data.joint_names.push_back(s.text("robot", fmt::format("/joint/{}/name", j)));
    data.joint_names.back().unit = unit_of(joints[j]).name;
  }
  for (std::size_t j = 0; j < s.calibration.cell.robot.positioner.size(); ++j)
    data.joint_names.push_back(s.text("robot", fmt::format("/positioner/{}/name", j)));
  const std::vector<bool> outlier = outliers_of(s);
  for (std::size_t i = 0; i < s.touches.size(); ++i) {
    const calib::Touch& touch = s.touches[i];
    const auto from = [&](const std::string& field) {
      return fmt::format("touch#{}/{}", i, field);
    };
    TouchRow row{{std::to_string(i + 1), from("number"), static_cast<double>(i + 1)},
                 {touch.target, from("target")},
                 {outlier[i] ? "left out" : to_string(touch.set), from("set")},
                 {"", from("readings")},
                 {"", from("speed_mm_s")},
                 {"", from("temperature_c")},
                 {touch.time, from("time")},
                 {}};
    if (touch.readings > 0) row.readings = raw_figure(touch.readings, "", 0, row.readings.from);
    if (touch.speed_m_s > 0.0)
      row.speed = raw_figure(touch.speed_m_s * kMmPerM, "mm/s", kSpeedDecimals, row.speed.from);
    if (touch.temperature_c)
      row.temperature =
          raw_figure(*touch.temperature_c, "°C", kTemperatureDecimals, row.temperature.from);
    for (std::size_t j = 0; j < touch.joint_rad.size(); ++j) {
      const calib::JointUnit unit = unit_of(joints.at(j));
      row.joints.push_back(raw_figure(touch.joint_rad[j] * unit.per_si, unit.name, kJointDecimals,
                                      from(fmt::format("joint_{}/{}", unit.name, j))));
    }
    for (std::size_t j = 0; j < touch.positioner_rad.size(); ++j)
      row.joints.push_back(raw_figure(touch.positioner_rad[j] * calib::kDegPerRad, "deg",
                                      kJointDecimals, from(fmt::format("positioner_deg/{}", j))));
    data.rows.push_back(std::move(row));
  }
}

constexpr int kDecisionDecimals = 3;

bool is_set(const calib::Finding& finding, const char* name) {
  for (const calib::Quantity& one : finding.evidence)
    if (one.name == name) return one.value != 0.0;
  return false;
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
  add_identity(sources, issue, data);
  add_artefacts(sources, data);
  add_length_checks(sources, data);
  add_figures(sources, data);
  add_budget(sources, data);
  data.pose_sheet = pose_sheet_of(sources, outliers_of(sources));
  data.decision = decision_of(sources);
  add_conditions(sources, data);
  add_findings(sources, data);
  add_parameters(sources, data);
  add_positioner(sources, data);
  add_linear_unit(sources, data);
  add_files(sources, data);
  add_touches(sources, data);
  return data;
}

Decision decision_of(const Sources& sources) {
  Decision decision;
  const auto& findings = sources.calibration.verdict.findings;
  for (std::size_t i = 0; i < findings.size(); ++i) {
    if (findings[i].kind != calib::FindingKind::kGain) continue;
    const auto evidence = [&](const char* name, const char* unit, int decimals) {
      return sources.number("calibration",
                            fmt::format("/verdict/findings/{}/evidence/{}/value", i, name), unit,
                            decimals);
    };
    decision.stated = true;
    decision.by_cell_file = is_set(findings[i], "required_is_stated");
    decision.predicted = evidence("predicted", "mm", kDecisionDecimals);
    decision.required = evidence("required", "mm", kDecisionDecimals);
    decision.nominal = evidence("nominal", "mm", kDecisionDecimals);
    decision.of_nominal = evidence("of_nominal", "%", 1);
    decision.most_of_nominal = evidence("most_of_nominal", "%", 0);
  }
  return decision;
}

}  // namespace cellcal::daemon::certificate
