#include "calib/verdict/change.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include "calib/estimate/predict.h"
#include "calib/estimate/region.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"

namespace cellcal::calib {

namespace {

constexpr unsigned kSeed = 20241120;
constexpr std::size_t kLeastPoses = 20;
/// Both calibrations share tolerances and ripple, so that their stated errors are rarely reached.
/// Errors of an arm are correlated: this is about three sigma.
constexpr double kChanged = 3.0;

/// Tip in the base frame [m].
using TipOf = std::function<Eigen::Vector3d(const JointVector&)>;

TipOf tip_of(const Predictor& arm) {
  return [&arm](const JointVector& q) -> Eigen::Vector3d {
    return arm.calibrated(q).tcp.translation();
  };
}

/// Distances of the tips at each pose [m], without a motion of the base.
Eigen::VectorXd tips_apart_m(const TipOf& one, const TipOf& other,
                             const std::vector<JointVector>& poses) {
  const auto n = static_cast<Eigen::Index>(poses.size());
  Eigen::VectorXd apart(3 * n);
  Eigen::Matrix<double, Eigen::Dynamic, 6> base(3 * n, 6);
  for (Eigen::Index i = 0; i < n; ++i) {
    const JointVector& q = poses[static_cast<std::size_t>(i)];
    const Eigen::Vector3d tip = other(q);
    apart.segment<3>(3 * i) = tip - one(q);
    base.middleRows<3>(3 * i) = base_motion(tip);
  }
  apart -= base * least_squares(base, apart);
  Eigen::VectorXd distances(n);
  for (Eigen::Index i = 0; i < n; ++i) distances[i] = apart.segment<3>(3 * i).norm();
  return distances;
}

/// A tool's place, which a calibration that does not identify it has as its cell file states it.
bool is_stated_in(const Cell& cell, const ParameterResult& parameter, const std::string& name) {
  return parameter.key.kind == ParameterKind::kTcp && parameter_key(cell, name);
}

ParameterResult as_stated(ParameterResult parameter) {
  parameter.nominal = parameter.correction = parameter.sigma = 0.0;
  return parameter;
}

}  // namespace

std::optional<Change> change_since(const Calibration& last, const Calibration& now,
                                   std::span<const Touch> touches) {
  if (!same_nominal(last.cell, now.cell)) return {};
  Change change;
  change.workspace = last.verdict.workspace && now.verdict.workspace;
  const auto poses = poses_in_scope(now.cell, touches, change.workspace, kScopePoses);
  if (poses.size() < kLeastPoses) return {};
  const Predictor before(last), after(now);
  const Eigen::VectorXd apart = tips_apart_m(tip_of(before), tip_of(after), poses);
  for (const double one : apart) change.mean_m += one / static_cast<double>(apart.size());
  change.expected_m = std::hypot(before.mean_error_m(poses), after.mean_error_m(poses));
  if (!(change.expected_m > 0.0)) return {};
  return change;
}

void judge_change(const Calibration& last, const std::string& which, bool accepted,
                  std::span<const Touch> touches, Calibration& now) {
  Verdict& verdict = now.verdict;
  if (has(verdict.findings, FindingKind::kNotIdentified)) return;  // the result is the nominal arm
  Finding finding{FindingKind::kNotCompared, Severity::kWarns};
  finding.text = which;
  const auto change = change_since(last, now, touches);
  if (!change) {
    verdict.add(std::move(finding));
    return;
  }
  finding.evidence = {in_mm("apart", change->mean_m),
                      in_mm("expected", change->expected_m),
                      {"ratio", change->mean_m / change->expected_m},
                      {"workspace", change->workspace}};
  if (!(change->mean_m > kChanged * change->expected_m)) {  // (59)
    finding.kind = FindingKind::kUnchanged;
    finding.severity = Severity::kInforms;
    verdict.add(std::move(finding));
    return;
  }
  if (accepted) {
    finding.kind = FindingKind::kChangeAccepted;
    verdict.add(std::move(finding));
    return;
  }
  finding.kind = FindingKind::kChanged;
  finding.severity = Severity::kWithholds;
  verdict.add_first(std::move(finding));
}

ParameterDifferences parameter_differences(const Calibration& before, const Calibration& after) {
  constexpr double kCoverage = 2.0;
  std::map<std::string, const ParameterResult*, std::less<>> were;
  for (const ParameterResult& was : before.parameters)
    were.emplace(parameter_name(before.cell, was.key), &was);
  ParameterDifferences differences;
  const auto compare = [&](std::string name, const ParameterResult& was,
                           const ParameterResult& now) {
    if (was.decided_by == DecidedBy::kFrame || now.decided_by == DecidedBy::kFrame) {
      differences.not_compared.push_back(std::move(name));
      return;
    }
    MovedParameter one{std::move(name),
                       now.unit,
                       now.to_unit,
                       was.nominal + was.correction,
                       now.nominal + now.correction,
                       kCoverage * std::hypot(was.sigma, now.sigma)};
    if (std::abs(one.after - one.before) > one.expanded)
      differences.moved.push_back(std::move(one));
  };
  for (const ParameterResult& now : after.parameters) {
    std::string name = parameter_name(after.cell, now.key);
    const auto found = were.find(name);
    if (found != were.end()) {
      compare(std::move(name), *found->second, now);
      were.erase(found);
    } else if (is_stated_in(before.cell, now, name)) {
      compare(std::move(name), as_stated(now), now);
    } else {
      differences.only_after.push_back(std::move(name));
    }
  }
  for (const ParameterResult& was : before.parameters) {
    std::string name = parameter_name(before.cell, was.key);
    if (!were.contains(name)) continue;
    if (is_stated_in(after.cell, was, name))
      compare(std::move(name), was, as_stated(was));
    else
      differences.only_before.push_back(std::move(name));
  }
  std::ranges::stable_sort(differences.moved, std::greater{}, [](const MovedParameter& one) {
    return one.expanded > 0.0 ? std::abs(one.after - one.before) / one.expanded : HUGE_VAL;
  });
  return differences;
}

bool same_nominal(const Cell& a, const Cell& b) {
  constexpr double kRounding = 1e-9;
  const auto near = [](double x, double y) { return std::abs(x - y) <= kRounding; };
  return a.robot.joints.size() == b.robot.joints.size() &&
         a.tool.tcp.isApprox(b.tool.tcp, kRounding) &&
         a.robot.flange_fixed.isApprox(b.robot.flange_fixed, kRounding) &&
         std::equal(a.robot.positioner.begin(), a.robot.positioner.end(),
                    b.robot.positioner.begin(), b.robot.positioner.end(),
                    [&](const PositionerAxis& x, const PositionerAxis& y) {
                      return x.sign == y.sign && x.frame.isApprox(y.frame, kRounding);
                    }) &&
         std::equal(a.robot.joints.begin(), a.robot.joints.end(), b.robot.joints.begin(),
                    [&](const Joint& x, const Joint& y) {
                      return x.sign == y.sign && near(x.offset_rad, y.offset_rad) &&
                             near(x.d_m, y.d_m) && near(x.a_m, y.a_m) &&
                             near(x.alpha_rad, y.alpha_rad) && near(x.beta_rad, y.beta_rad);
                    });
}

std::vector<JointVector> poses_in_scope(const Cell& cell, std::span<const Touch> touches,
                                        bool workspace, int count) {
  const ArmModel arm(cell);
  if (workspace) return workspace_poses(arm, count, kSeed);
  const auto region = tracker_region(cell, touches);
  if (!region.empty()) return poses_between(region, count, kSeed);
  std::vector<JointVector> around;
  std::vector<Eigen::Vector3d> touched_m;
  for (const Touch& touch : touches) {
    around.push_back(touch.joint_rad);
    touched_m.push_back(arm.nominal_tip_m(touch.joint_rad, arm.tool_index(touch.tool)));
  }
  return local_poses(arm, around, touched_m, count, kSeed);
}

std::optional<InScope> apart_in_scope(const Calibration* earlier, const Calibration& now,
                                      std::span<const Touch> touches, bool workspace) {
  if (earlier != nullptr && !same_nominal(earlier->cell, now.cell)) return {};
  const auto poses = poses_in_scope(now.cell, touches, workspace, kScopePoses);
  if (poses.size() < kLeastPoses) return {};
  const Predictor after(now), before(earlier != nullptr ? *earlier : now);
  const TipOf nominal = [&](const JointVector& q) -> Eigen::Vector3d {
    return after.nominal(q).translation();
  };
  const Eigen::VectorXd apart =
      tips_apart_m(earlier != nullptr ? tip_of(before) : nominal, tip_of(after), poses);
  InScope in{workspace, static_cast<int>(poses.size()), apart.mean(), apart.maxCoeff()};
  for (const JointVector& q : poses) {
    const double u95_m = after.calibrated(q).u95_m;
    in.mean_u95_m += u95_m / in.poses;
    in.max_u95_m = std::max(in.max_u95_m, u95_m);
  }
  return in;
}

}  // namespace cellcal::calib
