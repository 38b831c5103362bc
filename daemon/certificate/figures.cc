// Accuracy of the arm: as found and as left, and the uncertainty of it.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/check/pose_sheet.h"
#include "calib/estimate/region.h"
#include "calib/model/enum_table.h"
#include "calib/model/units.h"
#include "calib/result/finding_phrase.h"
#include "calib/verdict/change.h"
#include "calib/verdict/verdict.h"
#include "daemon/certificate/sources.h"

namespace cellcal::daemon::certificate {

namespace {

using calib::kMmPerM;
using Json = nlohmann::ordered_json;

constexpr int kFineDecimals = 4;

Entry mm(double metres, const std::string& from) {
  return figure(metres * kMmPerM, "mm", kMmDecimals, from);
}

/// Value computed from two others.
Entry of_two(const Sources& s, const char* function, const std::string& a, const std::string& b,
             const std::string& unit, double (*compute)(double, double)) {
  const Entry one = s.number(a, unit, kFineDecimals), other = s.number(b, unit, kFineDecimals);
  const std::string from = fmt::format("{}({},{})", function, a, b);
  if (!one.value || !other.value) return {"", from};
  return figure(compute(*one.value, *other.value), unit, kFineDecimals, from);
}

/// In the calibration's names of values over the scope.
std::string scope_of(const Sources& s) { return s.calibration.verdict.workspace ? "m3" : "m2"; }

/// `factor` times the standard uncertainty of a TCP position.
Entry uncertainty(const Sources& s, double factor, const char* factor_name, int decimals) {
  const std::string at = fmt::format("calibration#/predicted/{}_mm", scope_of(s));
  const double mean = s.number(at, "mm", kMmDecimals).value.value_or(0.0);
  return figure(factor * (mean / calib::kMeanOverRms), "mm", decimals,
                fmt::format("{}rms({})", factor_name, at));
}
Entry expanded_uncertainty(const Sources& s) {
  return uncertainty(s, kCoverage, "k*", kMmDecimals);
}

/// `found`, `left`: not stated where they do not apply.
void add_figure(CertificateData& data, const std::string& id, const Entry& found,
                const Entry& left) {
  data.content["figures"].push_back(
      {{"what", data.said(id)}, {"as_found", found}, {"as_left", left}});
}

/// Residuals by the earlier calibration or, without one, by the nominal geometry (`before`); not stated
/// without touches.
void add_summary(const Sources& s, const std::string& ids, const char* part,
                 const calib::ResidualSummary* found, const std::string& before,
                 const std::string& after, CertificateData& data) {
  // a file of an earlier version states no count
  const double count =
      found != nullptr ? found->count : s.number(before + "count", "", 0).value.value_or(1.0);
  const auto line = [&](const char* word, const std::string& key,
                        double calib::ResidualSummary::*value) {
    Entry as_found;
    if (count > 0.0)
      as_found = found != nullptr ? mm(found->*value, fmt::format("found#{}/{}", part, key))
                                  : s.number(before + key, "mm", kMmDecimals);
    add_figure(data, ids + word, as_found, s.number(after + key, "mm", kMmDecimals));
  };
  line("mean", "mean_mm", &calib::ResidualSummary::mean_m);
  line("largest", "max_mm", &calib::ResidualSummary::max_m);
  line("rms", "rms_mm", &calib::ResidualSummary::rms_m);
}

/// `earlier`: the calibration that the arm was found by; null: the nominal arm.
void add_scope_figures(const Sources& s, const calib::Calibration* earlier, CertificateData& data) {
  const auto predicted = [&](const std::string& key) {
    return s.number("calibration#/predicted/" + key, "mm", kMmDecimals);
  };
  const std::string m = scope_of(s);
  const auto scope =
      calib::apart_in_scope(earlier, s.calibration, s.touches, s.calibration.verdict.workspace);
  const Entry left = predicted(m + "_mm"), expanded = expanded_uncertainty(s);
  if (!scope) {
    add_figure(data, "say.certificate.tcp.mean", {}, left);
    add_figure(data, "say.certificate.u", {}, expanded);
    return;
  }
  data.content["poses"] = Entry{std::to_string(scope->poses), "scope#poses", scope->poses};
  // For the nominal arm the calibration states it; an earlier version has another value there.
  const bool stated = earlier == nullptr && s.calibration.nominal_workspace_u_m > 0.0;
  add_figure(data, "say.certificate.tcp.mean",
             stated ? predicted("nominal_" + m + "_mm") : mm(scope->mean_apart_m, "scope#mean_mm"),
             left);
  add_figure(data, "say.certificate.tcp.largest", mm(scope->max_apart_m, "scope#max_mm"), {});
  if (stated)
    add_figure(data, "say.certificate.u_of_mean", predicted("nominal_" + m + "_u_mm"), {});
  add_figure(data, "say.certificate.u", expanded, expanded);
  add_figure(data, "say.certificate.bound.mean", {}, mm(scope->mean_u95_m, "scope#u95_mean_mm"));
  add_figure(data, "say.certificate.bound.largest", {}, mm(scope->max_u95_m, "scope#u95_max_mm"));
}

bool is_set(const calib::Finding& finding, const char* name) {
  for (const calib::Quantity& one : finding.evidence)
    if (one.name == name) return one.value != 0.0;
  return false;
}

}  // namespace

void add_figures(const Sources& s, CertificateData& data) {
  std::optional<calib::FoundResiduals> found;  // none: by the nominal arm
  if (s.earlier && calib::same_nominal(s.earlier->cell, s.calibration.cell))
    found = calib::found_residuals(*s.earlier, s.touches, outliers_of(s));
  Json& content = data.content;
  content["scope"] = s.calibration.verdict.workspace ? "workspace" : "near targets";
  content["as_found_by"] = nullptr;
  if (found) {
    content["as_found_by"] = Entry{s.compared->words, "compared#words"};
    data.phrases[s.compared->words] = calib::calibration_phrase(s.compared->words);
  }
  content["earlier_not_comparable"] = s.compared && !found;
  content["figures"] = Json::array();
  add_summary(s, "say.certificate.tip.fitted.", "fit", found ? &found->fit : nullptr,
              "calibration#/residuals/before/", "calibration#/residuals/after/", data);
  if (s.calibration.check.count > 0)
    add_summary(s, "say.certificate.tip.check.", "check", found ? &found->check : nullptr,
                "calibration#/residuals/check_before/", "calibration#/residuals/check/", data);
  add_scope_figures(s, found ? &*s.earlier : nullptr, data);
}

Json decision(const Sources& s) {
  const auto& findings = s.calibration.verdict.findings;
  const auto gain = std::ranges::find(findings, calib::FindingKind::kGain, &calib::Finding::kind);
  if (gain == findings.end()) return nullptr;
  const auto evidence = [&](const char* name, const char* unit, int decimals) {
    return s.number(fmt::format("calibration#/verdict/findings/{}/evidence/{}/value",
                                gain - findings.begin(), name),
                    unit, decimals);
  };
  return {{"rule", "simple acceptance"},
          {"limit_by", is_set(*gain, "required_is_stated") ? "cell file" : "default"},
          {"predicted", evidence("predicted", "mm", kMmDecimals)},
          {"required", evidence("required", "mm", kMmDecimals)},
          {"nominal", evidence("nominal", "mm", kMmDecimals)},
          {"of_nominal", evidence("of_nominal", "%", 1)},
          {"most_of_nominal", evidence("most_of_nominal", "%", 0)}};
}

Json length_checks(const Sources& s) {
  Json checks = Json::array();
  for (std::size_t i = 0; i < s.size("calibration#/lengths"); ++i) {
    const std::string at = fmt::format("calibration#/lengths/{}/", i);
    if (s.text(at + "role").text != "check") continue;
    const auto value = [&](const char* key) { return s.number(at + key, "mm", kFineDecimals); };
    const auto twice = [&](const char* key) { return s.expanded(at + key, "mm", kFineDecimals); };
    checks.push_back(
        {{"between", {s.text(at + "between/0"), s.text(at + "between/1")}},
         {"certified", value("certified_mm")},
         {"certified_expanded", twice("certified_sigma_mm")},
         {"measured", value("by_others_mm")},
         {"expanded", twice("by_others_sigma_mm")},
         {"deviation", of_two(s, "difference", at + "by_others_mm", at + "certified_mm", "mm",
                              [](double a, double b) { return a - b; })},
         {"deviation_expanded",
          of_two(s, "k*hypot", at + "by_others_sigma_mm", at + "certified_sigma_mm", "mm",
                 [](double a, double b) { return kCoverage * std::hypot(a, b); })}});
  }
  return checks;
}

void add_budget(const Sources& s, CertificateData& data) {
  Json lines = Json::array();
  for (const calib::UncertaintyLine& part : s.calibration.uncertainty) {
    const std::string at = fmt::format("calibration#/uncertainty/{}/", lines.size());
    const std::string key = at + scope_of(s) + "_mm", unit = calib::unit_of(part.source).name;
    Entry sigma, sensitivity;
    if (part.sigma > 0.0) {
      sigma = s.number(at + "sigma", unit, kFineDecimals);
      sensitivity = of_two(s, "ratio", key, at + "sigma", "mm/" + unit,
                           [](double a, double b) { return a / b; });
    }
    lines.push_back(
        {{"source", data.said("say.certificate.source." + std::string(own_name(part.source)))},
         {"distribution", "normal"},
         {"sigma", sigma},
         {"sensitivity", sensitivity},
         {"contribution", s.number(key, "mm", kFineDecimals)}});
  }
  data.content["uncertainty_budget"] = {{"lines", lines},
                                        {"standard", uncertainty(s, 1.0, "", kFineDecimals)},
                                        {"expanded", expanded_uncertainty(s)}};
}

Json pose_sheet(const Sources& s) {
  const calib::PoseSheet sheet = calib::pose_sheet(s.calibration, s.touches, outliers_of(s));
  if (sheet.accuracy.empty() && sheet.repeatability.empty()) return nullptr;
  Json accuracy = Json::array(), repeatability = accuracy;
  for (const calib::PoseAccuracy& one : sheet.accuracy) {
    const auto from = [&](const char* field) {
      return fmt::format("poses#accuracy/{}/{}", accuracy.size(), field);
    };
    accuracy.push_back({{"target", Entry{one.target, from("target")}},
                        {"poses", figure(one.poses, "", 0, from("poses"))},
                        {"ap_mean", mm(one.mean_m, from("mean_mm"))},
                        {"ap_largest", mm(one.max_m, from("max_mm"))},
                        {"predicted", mm(one.predicted_m, from("predicted_mm"))}});
  }
  for (const calib::PoseRepeatability& one : sheet.repeatability) {
    const auto from = [&](const char* field) {
      return fmt::format("poses#repeatability/{}/{}", repeatability.size(), field);
    };
    repeatability.push_back(
        {{"target", Entry{one.target, from("target")}},
         {"first", figure(static_cast<double>(one.first + 1), "", 0, from("first"))},
         {"repeats", figure(one.repeats, "", 0, from("repeats"))},
         {"mean", mm(one.mean_m, from("mean_mm"))},
         {"sigma", mm(one.sigma_m, from("sigma_mm"))},
         {"rp", mm(one.rp_m, from("rp_mm"))},
         {"predicted", mm(one.predicted_m, from("predicted_mm"))}});
  }
  return {{"terms", "ISO 9283"},
          {"is_a_test_by_it", false},
          {"accuracy", accuracy},
          {"repeatability", repeatability}};
}

}  // namespace cellcal::daemon::certificate
