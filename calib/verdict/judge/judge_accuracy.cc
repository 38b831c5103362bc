#include "calib/verdict/judge/judge_accuracy.h"

#include <algorithm>

namespace cellcal::calib {

namespace {

/// Mean 3-D error that a result may be published with where the cell file asks for none
/// (required_mm): what industrial arms have as they are delivered. More is no calibration.
constexpr double kRequiredM = 2e-3;
/// And of the nominal arm's own error, or of what its tolerances foresee where it is the better of its kind: closer
/// to it than this, and the touches tell nothing.
constexpr double kOfNominal = 0.8;

struct Foreseen {
  double predicted_m, nominal_m, tolerated_m, required_m;
  std::vector<Quantity> evidence;
};

Foreseen foreseen(const Cell& cell, const Calibration& c, bool workspace) {
  Foreseen all{workspace ? c.predicted_workspace_m : c.predicted_near_targets_m,
               workspace ? c.nominal_workspace_m : c.nominal_near_targets_m,
               workspace ? c.tolerated_workspace_m : c.tolerated_near_targets_m,
               cell.required_m.value_or(kRequiredM),
               {}};
  all.evidence = {in_mm("predicted", all.predicted_m),
                  in_mm("nominal", all.nominal_m),
                  in_mm("nominal_u",
                        workspace ? c.nominal_workspace_u_m : c.nominal_near_targets_u_m),
                  in_mm("tolerated", all.tolerated_m),
                  {"of_nominal", 100.0 * all.predicted_m / all.nominal_m, "%"},
                  {"most_of_nominal", 100.0 * kOfNominal, "%"},
                  in_mm("required", all.required_m),
                  {"required_is_stated", cell.required_m ? 1.0 : 0.0, ""},
                  {"workspace", workspace ? 1.0 : 0.0, ""}};
  return all;
}

}  // namespace

void judge_predicted(const Cell& cell, const Calibration& c, bool workspace,
                     std::vector<Finding>& findings) {
  if (!(c.nominal_workspace_m > 0.0)) return;
  const Foreseen all = foreseen(cell, c, workspace);
  if (all.predicted_m > all.required_m)
    findings.push_back({FindingKind::kRequired, Severity::kWithholds, {}, all.evidence});
  if (all.predicted_m > kOfNominal * std::max(all.nominal_m, all.tolerated_m))
    findings.push_back({FindingKind::kNoGain, Severity::kWithholds, {}, all.evidence});
}

void note_gain(const Cell& cell, const Calibration& c, bool workspace,
               std::vector<Finding>& findings) {
  if (!(c.nominal_workspace_m > 0.0)) return;
  findings.push_back(
      {FindingKind::kGain, Severity::kInforms, {}, foreseen(cell, c, workspace).evidence});
}

void note_model_error(const Problem& problem, const Calibration& c,
                      std::vector<Finding>& findings) {
  const Discrepancy& d = c.discrepancy;
  if (!(d.sigma_m > 0.0)) return;
  Finding finding{FindingKind::kModelError,
                  Severity::kWarns,
                  {},
                  {in_mm("sigma", d.sigma_m),
                   {"estimated", d.estimated ? 1.0 : 0.0, ""},
                   in_mm("scatter", c.touch_noise_m),
                   in_mm("noise", d.noise_m),
                   in_mm("stated", problem.cell().touch_sigma_m)}};
  if (c.repeats.degrees_of_freedom > 0.0)
    finding.evidence.push_back(in_mm("repeats", c.repeats.scatter_m));
  if (d.reach_rad > 0.0) finding.evidence.push_back(in_deg("reach", d.reach_rad));
  findings.push_back(std::move(finding));
}

}  // namespace cellcal::calib
