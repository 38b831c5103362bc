#include "calib/verdict/change.h"

#include <cmath>
#include <utility>

#include "calib/uncertainty/predict.h"
#include "calib/verdict/tips_apart.h"

namespace cellcal::calib {

namespace {

constexpr int kPoses = 300;
constexpr std::size_t kLeastPoses = 20;
/// Both calibrations are pulled the same way by the same tolerances, and see the same ripple: what
/// they state is rarely reached. Errors of an arm go together, so that this is about three sigma.
constexpr double kChanged = 3.0;

}  // namespace

std::optional<Change> change_since(const Calibration& last, const Calibration& now,
                                   std::span<const Touch> touches) {
  if (!same_nominal(last.cell, now.cell)) return {};
  Change change;
  change.workspace = last.verdict.workspace && now.verdict.workspace;
  const auto poses = poses_in_scope(now.cell, touches, change.workspace, kPoses);
  if (poses.size() < kLeastPoses) return {};
  const Predictor before(last), after(now);
  const Eigen::VectorXd apart = tips_apart_m(
      [&](const JointVector& q) -> Eigen::Vector3d { return before.calibrated(q).tcp.translation(); },
      [&](const JointVector& q) -> Eigen::Vector3d { return after.calibrated(q).tcp.translation(); },
      poses);
  for (const double one : apart) change.mean_m += one / static_cast<double>(apart.size());
  change.expected_m = std::hypot(before.mean_error_m(poses), after.mean_error_m(poses));
  if (!(change.expected_m > 0.0)) return {};
  return change;
}

void judge_change(const Calibration& last, const std::string& which, bool accepted,
                  std::span<const Touch> touches, Calibration& now) {
  std::vector<Finding>& findings = now.verdict.findings;
  if (has(findings, FindingKind::kNotIdentified)) return;  // it is the nominal arm
  Finding finding{FindingKind::kNotCompared, Severity::kWarns};
  finding.text = which;
  const auto change = change_since(last, now, touches);
  if (!change) {
    findings.push_back(std::move(finding));
    return;
  }
  finding.evidence = {in_mm("apart", change->mean_m),
                      in_mm("expected", change->expected_m),
                      {"ratio", change->mean_m / change->expected_m, ""},
                      {"workspace", change->workspace ? 1.0 : 0.0, ""}};
  if (!(change->mean_m > kChanged * change->expected_m)) {  // (59)
    finding.kind = FindingKind::kUnchanged;
    finding.severity = Severity::kInforms;
    findings.push_back(std::move(finding));
    return;
  }
  if (accepted) {
    finding.kind = FindingKind::kChangeAccepted;
    findings.push_back(std::move(finding));
    return;
  }
  now.verdict.publish = now.verdict.too_few = false;
  finding.kind = FindingKind::kChanged;
  finding.severity = Severity::kWithholds;
  findings.insert(findings.begin(), std::move(finding));
}

}  // namespace cellcal::calib
