#include "calib/identify/update.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "calib/estimate/region.h"
#include "calib/identify/explained.h"
#include "calib/model/enum_table.h"
#include "calib/model/error.h"
#include "calib/model/kinematics.h"
#include "calib/model/units.h"
#include "calib/verdict/judge.h"
#include "calib/verdict/residuals.h"

namespace cellcal::calib {

namespace {

ArmModel arm_of(const Calibration& c) { return ArmModel(at_level(c.cell, c.level)); }

Eigen::VectorXd stays_m2(const ArmModel& arm, const Calibration& c,
                         const std::vector<JointVector>& poses) {
  const double field_m2 = 3.0 * c.discrepancy.sigma_m * c.discrepancy.sigma_m;
  return ripple_variance_m2(arm, poses, c.level.ripple_rad).array() + field_m2;
}

}  // namespace

std::vector<CarriedPose> stated_on_positioner(const Calibration& c, int count) {
  return carried_poses(arm_of(c), c, static_cast<int>(c.cell.robot.positioner.size()), count,
                       kRegionSeed);
}

Eigen::MatrixXd carried_moves(const Calibration& c, const std::vector<CarriedPose>& poses) {
  const ArmModel arm = arm_of(c);
  if (poses.size() < kFewestPoses) return Eigen::MatrixXd(0, arm.size());
  const Eigen::VectorXd x = arm_values(arm, c);
  return aligned(tip_moves(arm, poses, x.data()));
}

// Predicted position error of the tip by a calibration.

namespace {

/// Mean 3-D error [m] over the poses, including ripple and discrepancy; 0 for fewer than three.
double foreseen_error_m(const Calibration& c, const std::vector<JointVector>& poses) {
  if (poses.size() < kFewestPoses) return 0.0;
  const ArmModel arm = arm_of(c);
  const Eigen::VectorXd x = arm_values(arm, c);
  return predicted_mean_error_m(aligned_moves(arm, poses, x.data()), arm_covariance(arm, c),
                                stays_m2(arm, c, poses));
}

/// The same in the frame that a positioner's axes carry.
double foreseen_carried_m(const Calibration& c, const std::vector<CarriedPose>& poses) {
  if (poses.size() < kFewestPoses) return 0.0;
  const ArmModel arm = arm_of(c);
  std::vector<JointVector> postures;
  for (const CarriedPose& pose : poses) postures.push_back(pose.joint_rad);
  return predicted_mean_error_m(carried_moves(c, poses), arm_covariance(arm, c),
                                stays_m2(arm, c, postures));
}

/// Error of this arm's nominal model; zero for fewer than three poses.
NominalError nominal_error_of(const Calibration& c, const std::vector<JointVector>& poses) {
  if (poses.size() < kFewestPoses) return {};
  const ArmModel arm = arm_of(c);
  const Eigen::VectorXd x = arm_values(arm, c);
  return nominal_error(arm, poses, x.data(), aligned_moves(arm, poses, x.data()),
                       drawn_arms(arm_covariance(arm, c)), stays_m2(arm, c, poses));
}

std::vector<JointVector> stated_workspace(const Calibration& c, int count) {
  return workspace_poses(arm_of(c), count, kRegionSeed);
}

/// Poses near the targets in postures similar to those of the touches.
std::vector<JointVector> stated_near_targets(const Calibration& c,
                                             const std::vector<JointVector>& around, int count) {
  if (!c.region.empty()) return poses_between(c.region, count, kRegionSeed);
  const ArmModel arm = arm_of(c);
  std::vector<Eigen::Vector3d> centres;
  for (const TargetResult& target : c.targets)
    if (c.cell.targets[c.cell.target_index(target.id)].carried_by == 0)
      centres.push_back(target.centre_m);
  if (!c.cell.robot.positioner.empty())  // where its targets were touched
    for (const JointVector& touched : around) centres.push_back(arm.nominal_tip_m(touched));
  return local_poses(arm, around, centres, count, kRegionSeed);
}

// Verdict on an update: published, or withheld with its findings.

Subject about(const Explanation& one, const Cell& cell) {
  switch (one.kind) {
    case ChangeKind::kTool: return about_tool(one.name);
    case ChangeKind::kSphere: return about_target(cell.targets[cell.target_index(one.name)]);
    case ChangeKind::kJoint: return about_joint(one.name);
    case ChangeKind::kPositioner: return about_positioner(one.name);
    default: return {};
  }
}

std::vector<Quantity> evidence_of(const Explanation& one) {
  switch (one.kind) {
    case ChangeKind::kTool:
    case ChangeKind::kSphere: return shift_in_mm(one.shift_m, one.sigma);
    case ChangeKind::kPositioner: {
      std::vector<Quantity> evidence = shift_in_mm(one.shift_m, one.sigma);
      evidence.push_back(in_deg("turn", one.amount, one.turn_sigma));
      return evidence;
    }
    case ChangeKind::kJoint: return {in_deg("turn", one.amount, one.sigma)};
    case ChangeKind::kGrowth:
      return {{"growth", one.amount * kPerMillion, "ppm", one.sigma * kPerMillion}};
    case ChangeKind::kTouch: return {in_mm("off", one.amount, one.sigma)};
    case ChangeKind::kNothing: break;
  }
  return {};
}

FindingKind finding_of(UpdateOutcome outcome) {
  using enum UpdateOutcome;
  static constexpr EnumTable<UpdateOutcome, FindingKind> kTable{
      {{kUpdated, FindingKind::kUpdated},
       {kNothingChanged, FindingKind::kUpdateNotNeeded},
       {kContradicted, FindingKind::kUpdateContradicted},
       {kNotResolved, FindingKind::kUpdateNotResolved},
       {kNotFound, FindingKind::kUpdateNotFound},
       {kTooFewTouches, FindingKind::kUpdateTooFew}}};
  return kTable[outcome];
}

/// Replaces the findings of the calibration by those of `c.update`, which is filled in.
void judge_update(Calibration& c) {
  const UpdateOrigin& origin = *c.update;
  const bool updated = origin.outcome == UpdateOutcome::kUpdated;
  Finding finding{finding_of(origin.outcome), updated ? Severity::kInforms : Severity::kWithholds};
  finding.text = origin.stands_on;
  if (!origin.explanations.empty()) {
    finding.about = about(origin.explanations.front(), c.cell);
    finding.evidence = evidence_of(origin.explanations.front());
    finding.evidence.push_back(
        {"probability", 100.0 * origin.explanations.front().probability, "%"});
  }
  finding.evidence.push_back(
      {"touches", static_cast<double>(origin.touches - origin.set_aside.size()), ""});
  finding.evidence.push_back(in_mm("reached", origin.reached_m));
  finding.evidence.push_back(in_mm("before", origin.before_m));
  if (origin.on_positioner) finding.evidence.push_back({"on_positioner", 1.0, ""});
  for (const std::string& id : origin.not_found)
    finding.parts.push_back({about_target(c.cell.targets[c.cell.target_index(id)]), {}});
  if (origin.outcome == UpdateOutcome::kContradicted && origin.second)
    finding.parts.push_back({about(*origin.second, c.cell), evidence_of(*origin.second)});
  c.verdict.judged = true;
  c.verdict.add(std::move(finding));
  if (!updated) return;
  // An update has to meet the requirements of a full session.
  judge_predicted(c.cell, c, c.verdict);
  if (c.verdict.publish()) note_gain(c.cell, c, c.verdict);
}

/// Explanations of lower probability are neglected.
constexpr double kLeastProbability = 1e-4;
/// Probability of chi^2 below which the likeliest explanation is insufficient.
constexpr double kByChance = 5e-3;
/// Odds above which there is a further change.
constexpr double kMoreOdds = 3.0;
/// Posterior odds above which two things changed, equal to the prior odds.
constexpr double kTwoOdds = 0.1;
/// Largest number of erroneous touches; more of them have another cause.
constexpr std::size_t kMostSetAside = 2;
/// Probability from which a change is reported.
constexpr double kSure = 0.9;

/// Mean of all explanations and covariance about it, of the calibration's parameters.
struct Mean {
  Eigen::VectorXd x;
  Eigen::MatrixXd covariance;
};

Mean mean_of(const TouchEquations& touches, const std::vector<Weighed>& all) {
  const Eigen::Index n = touches.x().size();
  Mean mean{Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Zero(n, n)};
  double say = 0.0;
  for (const Weighed& one : all)
    if (one.probability > kLeastProbability) say += one.probability;
  for (const Weighed& one : all)
    if (one.probability > kLeastProbability) mean.x += one.probability / say * one.how.x;
  for (const Weighed& one : all) {
    if (!(one.probability > kLeastProbability)) continue;
    const Eigen::MatrixXd beforehand =
        touches.covariance() + one.usual * one.usual * one.moves * one.moves.transpose();
    const Eigen::VectorXd off = one.how.x - mean.x;
    mean.covariance +=
        one.probability / say * (one.how.covariance(beforehand) + off * off.transpose());  // (83)
  }
  mean.covariance = (0.5 * (mean.covariance + mean.covariance.transpose())).eval();
  const Eigen::Index p = touches.parameters();
  return {mean.x.head(p), mean.covariance.topLeftCorner(p, p)};
}

/// Removes a tip that the cell file states as known and that did not change.
void close_tip(const Calibration& last, Calibration& c) {
  const auto had = static_cast<Eigen::Index>(last.parameters.size());
  const auto added = c.covariance.rows() - had;
  if (added == 0 || !(c.covariance.bottomRightCorner(added, added).diagonal().maxCoeff() <= 0.0))
    return;
  c.parameters.resize(last.parameters.size());
  c.covariance.conservativeResize(had, had);
  if (c.frame_basis.rows() > had) c.frame_basis.conservativeResize(had, c.frame_basis.cols());
  c.cell.tool.tcp_sigma_m = last.cell.tool.tcp_sigma_m;
}

void place_targets(const Calibration& last, Calibration& c) {
  const auto moved = [&](const ParameterKey& key) {
    return correction_of(c, key) - correction_of(last, key);
  };
  for (TargetResult& target : c.targets) {
    if (target.kind != TargetKind::kSphere) continue;
    const std::size_t t = c.cell.target_index(target.id);
    for (int axis = 0; axis < 3; ++axis)
      target.centre_m[axis] += moved(target_parameter(ParameterKind::kCentre, t, axis));
    target.effective_radius_m += moved(tool_parameter(ParameterKind::kEffectiveRadius, 0)) +
                                 moved(target_parameter(ParameterKind::kRadius, t));
  }
}

Calibration at(const Calibration& last, const Calibration& prior, Mean mean) {
  Calibration c = prior;
  for (std::size_t i = 0; i < c.parameters.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    c.parameters[i].correction = mean.x[k] - c.parameters[i].nominal;
    c.parameters[i].sigma = std::sqrt(std::max(0.0, mean.covariance(k, k)));
  }
  c.covariance = std::move(mean.covariance);
  close_tip(last, c);
  place_targets(last, c);
  c.positioner = positioner_lines(c, {});
  for (std::size_t j = 0; j < c.positioner.size() && j < last.positioner.size(); ++j)
    c.positioner[j].touched_rad = last.positioner[j].touched_rad;
  return c;
}

ResidualSummary summary(const std::vector<TouchResidual>& residuals, double TouchResidual::*which) {
  std::vector<double> residuals_m;
  for (const TouchResidual& one : residuals)
    if (!one.outlier) residuals_m.push_back(one.*which);
  return summary_of(residuals_m);
}

/// Residuals; "before" is by the last calibration.
void fill_residuals(const TouchEquations& touches, const Weighed& best,
                    const std::vector<std::size_t>& set_aside, Calibration& c) {
  const Eigen::VectorXd before = touches.off_m(touches.x()), after = touches.off_m(best.how.x);
  c.residuals.clear();
  for (Eigen::Index k = 0; k < before.size(); ++k) {
    const auto t = static_cast<std::size_t>(k);
    const ForeseenContact& contact = touches.contacts()[t];
    c.residuals.push_back({t, before[k], after[k], after[k] / touches.sigma_m()[k],
                           std::ranges::find(set_aside, t) != set_aside.end() ||
                               (best.change.kind == ChangeKind::kTouch && best.change.index == t),
                           (contact.tip_m - contact.centre_m).normalized()});
  }
  c.before = summary(c.residuals, &TouchResidual::before_m);
  c.after = summary(c.residuals, &TouchResidual::after_m);
  c.check = c.check_before = {};
}

/// The touches that were set aside.
std::vector<Outlier> outliers_of(const Calibration& c, const std::vector<Touch>& touches) {
  std::vector<Outlier> outliers;
  for (const TouchResidual& r : c.residuals) {
    if (!r.outlier) continue;
    const std::string& id = touches[r.touch].target;
    outliers.push_back({.touch = r.touch,
                        .residual_m = r.after_m,
                        .kind = OutlierKind::kOffItsTarget,
                        .target = id,
                        .target_kind = c.cell.targets[c.cell.target_index(id)].kind,
                        .sigmas = std::abs(r.whitened)});
  }
  return outliers;
}

/// Removes results on the touches of the last session.
void forget_session(Calibration& c) {
  c.outliers.clear();
  c.moved.clear();
  c.jumped.clear();
  c.artefact_biases.clear();
  c.unseen = {};
  c.inputs.clear();
  c.log_evidence = 0.0;
  c.uncertainty.clear();
  c.verdict = {.workspace = c.verdict.workspace};
}

/// As kUpdateGoal, on a positioner: its foot has six unknowns, and fifteen touches cannot say all that a session does.
constexpr double kGoalOnPositioner = 1.5;

/// States in `origin` the tip's error on the positioner if it is too large there.
void compare_on_positioner(const Calibration& last, const Calibration& c, int count,
                           UpdateOrigin& origin) {
  const std::vector<CarriedPose> poses = stated_on_positioner(last, count);
  const double before_m = foreseen_carried_m(last, poses), reached_m = foreseen_carried_m(c, poses);
  if (reached_m <= kGoalOnPositioner * before_m || origin.reached_m > kUpdateGoal * origin.before_m)
    return;
  origin.before_m = before_m;
  origin.reached_m = reached_m;
  origin.on_positioner = true;
}

bool contradicted(const Sufficient& enough) {
  // A non-finite value counts as a contradiction.
  return !(enough.by_chance >= kByChance && enough.log_odds_more <= std::log(kMoreOdds));
}

bool two_things(double log_odds) { return !(log_odds <= std::log(kTwoOdds)); }

UpdateOutcome outcome_of(const UpdateOrigin& origin, bool contradictory) {
  const Explanation& first = origin.explanations.front();
  if (contradictory) return UpdateOutcome::kContradicted;
  if (origin.on_positioner || !(origin.reached_m <= kUpdateGoal * origin.before_m))
    return UpdateOutcome::kNotResolved;
  // A single erroneous touch is no change of the cell.
  if (first.kind == ChangeKind::kNothing || first.kind == ChangeKind::kTouch)
    return UpdateOutcome::kNothingChanged;
  return first.probability >= kSure ? UpdateOutcome::kUpdated : UpdateOutcome::kNotResolved;
}

/// Explanations after exclusion of erroneous touches.
struct Resolved {
  std::vector<Weighed> all;
  Sufficient enough;
  std::vector<std::size_t> set_aside;
  /// Log odds of two changes against one change with the excluded touches erroneous.
  double log_odds_two = 0.0;
};

double log_of_sum(double a, double b) {
  return std::max(a, b) + std::log1p(std::exp(-std::abs(a - b)));
}

/// Odds of two changes against one while touches are excluded one by one: these count as erroneous
/// on either side, or are explained.
class TwoChangeOdds {
 public:
  void add(const OneOrTwo& sums) {
    log_one_ = log_of_sum(log_one_, sums.log_one + log_wrong_);
    log_two_ = log_of_sum(log_two_, sums.log_two + log_wrong_);
    log_one_and_touch_ = sums.log_one_and_touch + log_wrong_;
  }
  void set_aside(double log_wrong) { log_wrong_ += log_wrong; }
  // (86)
  double log_odds() const { return log_two_ - log_of_sum(log_one_, log_one_and_touch_); }

 private:
  double log_one_ = std::numeric_limits<double>::lowest(), log_two_ = log_one_,
         log_one_and_touch_ = log_one_;
  double log_wrong_ = 0.0;
};

/// True for one touch of each sphere with several touches: two erroneous ones mean a sphere that
/// moved, and a single touch cannot be assessed.
std::vector<bool> may_be_set_aside(const std::vector<ForeseenContact>& contacts,
                                   const std::vector<std::size_t>& set_aside) {
  std::vector<bool> may(contacts.size(), true);
  for (std::size_t t = 0; t < contacts.size(); ++t) {
    may[t] = std::ranges::count(contacts, contacts[t].target, &ForeseenContact::target) > 1;
    for (const std::size_t gone : set_aside)
      if (contacts[gone].target == contacts[t].target) may[t] = false;
  }
  return may;
}

Resolved resolve(const Calibration& prior, TouchEquations& equations) {
  Resolved r;
  const std::size_t count = equations.contacts().size();
  TwoChangeOdds two_changes;
  while (true) {
    r.all = weighed(prior, equations);
    two_changes.add(one_or_two(r.all));
    r.log_odds_two = two_changes.log_odds();
    r.enough = sufficient(likeliest(r.all), r.all, r.set_aside.size());
    if (!contradicted(r.enough) || r.set_aside.size() == kMostSetAside ||
        count - r.set_aside.size() <= kLeastUpdateTouches)
      return r;
    const auto touch = doubtful_touch(r.all, may_be_set_aside(equations.contacts(), r.set_aside));
    if (!touch) return r;
    two_changes.set_aside(log_wrong(r.all, *touch));
    equations.set_aside(*touch);
    r.set_aside.push_back(*touch);
  }
}

}  // namespace

Calibration update(const Calibration& last, const std::vector<Touch>& touches,
                   const UpdateFacts& facts) {
  const Calibration prior = with_drift(last, facts.months);
  const std::vector<JointVector> workspace = stated_workspace(last, facts.region_poses);
  UpdateOrigin origin;
  origin.stands_on = facts.stands_on;
  origin.months = facts.months;
  origin.touches = touches.size();
  origin.not_found = facts.not_found;
  origin.before_m = origin.reached_m = foreseen_error_m(last, workspace);
  Calibration c = last;
  std::vector<Outlier> outliers;
  if (touches.size() >= kLeastUpdateTouches) {
    TouchEquations equations(prior, touches);
    const Resolved r = resolve(prior, equations);
    const Weighed& best = likeliest(r.all);
    origin.set_aside = r.set_aside;
    c = at(last, prior, mean_of(equations, r.all));
    fill_residuals(equations, best, r.set_aside, c);
    outliers = outliers_of(c, touches);
    c.chi2 = origin.chi2 = r.enough.chi2;
    c.degrees_of_freedom = origin.degrees_of_freedom = r.enough.degrees_of_freedom;
    c.chi2_per_dof = origin.chi2 / std::max(1.0, origin.degrees_of_freedom);
    origin.by_chance = r.enough.by_chance;
    origin.log_odds_second = r.log_odds_two;
    origin.second = r.enough.second;
    origin.explanations = explanations(r.all);
    c.predicted_workspace_m = origin.reached_m = foreseen_error_m(c, workspace);
    std::vector<JointVector> around;
    for (const Touch& touch : touches) around.push_back(touch.joint_rad);
    const auto near = stated_near_targets(c, around, facts.region_poses);
    c.predicted_near_targets_m =
        near.size() < kFewestPoses ? c.predicted_workspace_m : foreseen_error_m(c, near);
    const NominalError over_workspace = nominal_error_of(c, workspace);
    const NominalError local =
        near.size() < kFewestPoses ? over_workspace : nominal_error_of(c, near);
    c.nominal_workspace_m = over_workspace.mean_m;
    c.nominal_workspace_u_m = over_workspace.u_m;
    c.nominal_near_targets_m = local.mean_m;
    c.nominal_near_targets_u_m = local.u_m;
    compare_on_positioner(last, c, facts.region_poses, origin);
    origin.outcome = outcome_of(origin, contradicted(r.enough) || two_things(r.log_odds_two));
    if (best.change.kind == ChangeKind::kSphere)  // its certificates refer to the previous position
      std::erase_if(c.lengths, [&](const LengthResult& length) {
        return length.from == best.change.name || length.to == best.change.name;
      });
  }
  if (c.linear_unit) {
    const auto touched_m = c.linear_unit->touched_m;
    c.linear_unit = linear_unit_line(c, {});
    c.linear_unit->touched_m = touched_m;
  }
  if (!facts.not_found.empty()) origin.outcome = UpdateOutcome::kNotFound;
  forget_session(c);
  c.outliers = std::move(outliers);
  c.update = std::move(origin);
  judge_update(c);
  return c;
}

bool further_touches_pay(const UpdateOrigin& so_far) {
  return so_far.outcome != UpdateOutcome::kNothingChanged ||
         so_far.explanations.front().probability < kSure;
}

}  // namespace cellcal::calib
