#include "daemon/certificate/decision.h"

#include <fmt/format.h>

namespace cellcal::daemon::certificate {

namespace {

constexpr int kDecisionDecimals = 3;

bool is_set(const calib::Finding& finding, const char* name) {
  for (const calib::Quantity& one : finding.evidence)
    if (one.name == name) return one.value != 0.0;
  return false;
}

}  // namespace

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
