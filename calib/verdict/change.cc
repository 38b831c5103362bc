#include "calib/verdict/change.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "calib/linear/orthogonal.h"
#include "calib/model/kinematics.h"
#include "calib/uncertainty/predict.h"
#include "calib/uncertainty/region.h"

namespace cellcal::calib {

namespace {

constexpr int kPoses = 300;
constexpr unsigned kSeed = 20241120;
constexpr std::size_t kLeastPoses = 20;
/// Both calibrations are pulled the same way by the same tolerances, and see the same ripple: what
/// they state is rarely reached. Errors of an arm go together, so that this is about three sigma.
constexpr double kChanged = 3.0;

bool same_nominal(const Cell& a, const Cell& b) {
  constexpr double kRounding = 1e-9;
  const auto near = [](double x, double y) { return std::abs(x - y) <= kRounding; };
  return a.robot.joints.size() == b.robot.joints.size() &&
         a.tool.tcp.isApprox(b.tool.tcp, kRounding) &&
         a.robot.flange_fixed.isApprox(b.robot.flange_fixed, kRounding) &&
         std::equal(a.robot.joints.begin(), a.robot.joints.end(), b.robot.joints.begin(),
                    [&](const Joint& x, const Joint& y) {
                      return x.sign == y.sign && near(x.offset_rad, y.offset_rad) &&
                             near(x.d_m, y.d_m) && near(x.a_m, y.a_m) &&
                             near(x.alpha_rad, y.alpha_rad) && near(x.beta_rad, y.beta_rad);
                    });
}

std::vector<JointVector> poses_of(const Calibration& now, std::span<const Touch> touches,
                                  bool workspace) {
  const ArmModel arm(now.cell);
  if (workspace) return workspace_poses(arm, kPoses, kSeed);
  constexpr double kNearM = 0.150;
  std::vector<JointVector> around;
  std::vector<Eigen::Vector3d> touched_m;
  for (const Touch& touch : touches) {
    around.push_back(touch.joint_rad);
    touched_m.push_back(arm.nominal_tip_m(touch.joint_rad, arm.tool_index(touch.tool)));
  }
  return local_poses(arm, around, touched_m, kNearM, kPoses, kSeed);
}

}  // namespace

std::optional<Change> change_since(const Calibration& last, const Calibration& now,
                                   std::span<const Touch> touches) {
  if (!same_nominal(last.cell, now.cell)) return {};
  Change change;
  change.workspace = last.verdict.workspace && now.verdict.workspace;
  const auto poses = poses_of(now, touches, change.workspace);
  if (poses.size() < kLeastPoses) return {};
  const Predictor before(last), after(now);
  const auto n = static_cast<Eigen::Index>(poses.size());
  Eigen::VectorXd apart(3 * n);
  Eigen::Matrix<double, Eigen::Dynamic, 6> base(3 * n, 6);
  for (Eigen::Index i = 0; i < n; ++i) {
    const JointVector& q = poses[static_cast<std::size_t>(i)];
    const Eigen::Vector3d tip = after.calibrated(q).tcp.translation();
    apart.segment<3>(3 * i) = tip - before.calibrated(q).tcp.translation();
    base.middleRows<3>(3 * i) = base_motion(tip);
  }
  apart -= base * least_squares(base, apart);
  for (Eigen::Index i = 0; i < n; ++i)
    change.mean_m += apart.segment<3>(3 * i).norm() / static_cast<double>(n);
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
