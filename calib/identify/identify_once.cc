#include "calib/identify/identify_once.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "calib/estimate/budget.h"
#include "calib/estimate/discrepancy.h"
#include "calib/estimate/estimate.h"
#include "calib/estimate/external_axes.h"
#include "calib/estimate/joint_functions.h"
#include "calib/estimate/observability.h"
#include "calib/estimate/problem.h"
#include "calib/estimate/region.h"
#include "calib/estimate/repeats.h"
#include "calib/estimate/target.h"
#include "calib/model/units.h"
#include "calib/verdict/artefacts.h"
#include "calib/verdict/held_out.h"
#include "calib/verdict/residuals.h"
#include "calib/verdict/verdict.h"

namespace cellcal::calib {

namespace {

/// Number of poses that shows which directions of the frame move the tip.
constexpr int kFramePoses = 60;

/// Index of the first of the cell's tools that touched the target.
int first_tool(const Problem& problem, const TargetBlock& block) {
  int first = problem.arm().tool_count() - 1;
  for (std::size_t i = 0; i < problem.touches().size() && first > 0; ++i)
    if (problem.block_of(i) >= 0 &&
        problem.blocks()[static_cast<std::size_t>(problem.block_of(i))].target == block.target)
      first = std::min(first, problem.tool_of(i));
  return first;
}

void fill_parameters(const Problem& problem, const Estimate& e, const FrameDirections& frame,
                     double inflation, Calibration& calibration) {
  const Eigen::VectorXd x = problem.to_si(e.u);
  const int n = problem.size();
  const Eigen::VectorXd scale = problem.scales();
  calibration.covariance =
      inflation * (scale.asDiagonal() * e.posterior.covariance_u * scale.asDiagonal());
  calibration.frame_basis = scale.asDiagonal() * frame.basis_u;
  for (int i = 0; i < n; ++i) {
    const Unknown& unknown = problem.unknowns()[i];
    ParameterResult p{
        unknown.key,     unknown.unit,           unknown.to_unit,
        unknown.nominal, x[i] - unknown.nominal, std::sqrt(calibration.covariance(i, i))};
    // Decided by the frame if half of the variance is due to frame directions; by the prior if the
    // touches reduced its variance by less than half, or if no level with weight includes the
    // parameter.
    const double variance_u = e.posterior.covariance_u(i, i);
    const double of_frame = frame.basis_u.cols() > 0 ? frame.basis_u.row(i).squaredNorm() : 0.0;
    const double prior_u = prior_sigma_u(unknown, e.levels).value_or(1e9);
    if (of_frame * std::min(1.0, prior_u * prior_u) > 0.5 * variance_u)
      p.decided_by = DecidedBy::kFrame;
    else if (variance_u > 0.5 * prior_u * prior_u || variance_u == 0.0)
      p.decided_by = DecidedBy::kPrior;
    calibration.parameters.push_back(p);
  }
  for (const TargetBlock& block : problem.blocks()) {
    const Target& target = problem.cell().targets[block.target];
    TargetResult result = result_at(target, problem.place(block), x.data() + block.first);
    const int tool = first_tool(problem, block);
    if (target.kind == TargetKind::kSphere || target.kind == TargetKind::kPlane)
      result.effective_radius_m = problem.nominal_radius_m(target, tool) +
                                  (problem.rho(tool) >= 0 ? x[problem.rho(tool)] : 0.0) +
                                  (block.has_radius ? x[block.first + block.place] : 0.0);
    calibration.targets.push_back(result);
  }
}

std::vector<JointVector> poses_near_targets(const Problem& problem, const Calibration& c,
                                            int count) {
  if (!c.region.empty()) return poses_between(c.region, count, kRegionSeed);
  std::vector<JointVector> around;
  for (const Touch& touch : problem.touches()) around.push_back(touch.joint_rad);
  std::vector<Eigen::Vector3d> centres;
  for (const TargetResult& target : c.targets) {
    const std::size_t index = problem.cell().target_index(target.id);
    const bool stands = problem.cell().targets[index].carried_by == 0;
    if (stands && has_a_centre(target.kind) && target.kind != TargetKind::kWire) {
      centres.push_back(target.centre_m);
      continue;
    }
    for (std::size_t i = 0; i < problem.touches().size(); ++i)  // the touched position
      if (problem.touches()[i].target == target.id)
        centres.push_back(stands ? problem.arm().position(problem.pose(i), nullptr)
                                 : problem.arm().nominal_tip_m(problem.touches()[i].joint_rad));
  }
  return local_poses(problem.arm(), around, centres, count, kRegionSeed);
}

/// Whitened residuals of the touches, each by its own sigma, without correlation.
Eigen::VectorXd residuals_alone(const Posterior& posterior) {
  const auto r = posterior.linear.residual.head(posterior.linear.length_row);
  if (posterior.together.size() == 0) return r;
  return posterior.together.triangularView<Eigen::Lower>() * r;
}

/// Log evidence, comparable between different noise and unknowns, unlike that of the levels. The
/// noise differs with repeats and with a discrepancy; a target taken as two has additional
/// unknowns, of which those without a prior count as known to their scale (10 mm, 10 mrad).
double log_evidence(const Problem& problem, const Estimate& e) {
  double log_size = 0.0;
  for (Eigen::Index k = 0; k < e.posterior.together.rows(); ++k)
    log_size += std::log(e.posterior.together(k, k));
  for (std::size_t i = 0; i < e.use.size(); ++i) {
    if (problem.touches()[i].set != TouchSet::kFit) continue;
    const double sigma_m =
        e.use[i] ? problem.own_sigma_m(i) : std::hypot(problem.own_sigma_m(i), problem.field_m());
    log_size += problem.rows(i) * std::log(sigma_m) +
                (e.use[i] ? 0.0 : kOutlierSigma * kOutlierSigma / 2.0);
  }
  double log_flat = 0.0;
  for (const Unknown& unknown : problem.unknowns())
    if (!(unknown.prior_weight > 0.0)) log_flat += 0.5 * std::log(kFlatPrecision);
  return log_evidence(e.levels.levels) - log_flat - log_size;
}

/// Fills in the scatter of the fit and the touch noise.
void fill_fit(const Problem& problem, const Estimate& e, const Repeats& repeats, Calibration& c) {
  double sum = 0.0, held = 0.0, noise = 0.0, of_places = 0.0;
  const Eigen::VectorXd alone = residuals_alone(e.posterior);
  const MeanRows mean = mean_rows(problem, e.posterior.linear);
  sum = mean.linear.residual.head(mean.linear.length_row).squaredNorm() + mean.differences;  // (28)
  for (const auto& [touch, row] : e.posterior.linear.touch_row)
    for (int k = 0; k < problem.rows(touch); ++k) {
      held += 1.0 - e.posterior.leverage[row + k];
      if (k >= problem.place_rows(touch)) continue;  // rotations are no distances
      noise += std::pow(alone[row + k] * problem.sigma_m(touch), 2);
      of_places += 1.0 - e.posterior.leverage[row + k];
    }
  c.chi2 = sum;
  c.degrees_of_freedom = std::max(held, 1.0);
  c.chi2_per_dof = sum / c.degrees_of_freedom;
  c.touch_noise_m = std::sqrt(noise / std::max(of_places, 1.0));
  c.repeats = {repeats.touches, repeats.scatter_m, repeats.degrees_of_freedom, repeats.used_m};
}

/// Predicted position error of the tip by the estimate.
class Accuracy {
 public:
  Accuracy(const Problem& problem, const Estimate& e, double inflation, const Calibration& c)
      : arm_(problem.arm()),
        x_(problem.to_si(e.u)),
        scale_(problem.scales().head(arm_.size())),
        covariance_(inflation * e.posterior.covariance_u.topLeftCorner(arm_.size(), arm_.size())),
        arms_(drawn_arms(covariance_)),
        field_m2_(3.0 * std::pow(c.discrepancy.sigma_m, 2)),
        ripple_rad_(c.level.ripple_rad) {}

  Eigen::MatrixXd moves(const std::vector<JointVector>& poses) const {
    return aligned_moves(arm_, poses, x_.data(), scale_);
  }
  /// Moves with a rigid tool, for the frame directions: bending changes moves by parts per
  /// thousand.
  TipMoves stiff_moves(const std::vector<JointVector>& poses) const {
    Eigen::VectorXd stiff = x_;
    for (int i = 0; i < arm_.size(); ++i)
      if (arm_.parameters()[static_cast<std::size_t>(i)].kind == ParameterKind::kDeflection)
        stiff[i] = 0.0;
    return tip_moves(arm_, poses, stiff.data(), scale_);
  }
  double predicted_m(const std::vector<JointVector>& poses, const Eigen::MatrixXd& moves) const {
    return predicted_mean_error_m(moves, covariance_, stays_m2(poses));
  }
  NominalError nominal(const std::vector<JointVector>& poses, const Eigen::MatrixXd& moves) const {
    return nominal_error(arm_, poses, x_.data(), moves, arms_, stays_m2(poses));
  }
  /// Prediction for any arm within its tolerances, before any touch.
  double tolerated_m(const std::vector<JointVector>& poses, const Eigen::MatrixXd& moves) const {
    return predicted_mean_error_m(moves, Eigen::MatrixXd::Identity(arm_.size(), arm_.size()),
                                  stays_m2(poses));
  }

 private:
  Eigen::VectorXd stays_m2(const std::vector<JointVector>& poses) const {
    return ripple_variance_m2(arm_, poses, ripple_rad_).array() + field_m2_;
  }

  const ArmModel& arm_;
  Eigen::VectorXd x_, scale_;
  Eigen::MatrixXd covariance_, arms_;
  double field_m2_, ripple_rad_;
};

/// Figures over some poses.
struct OverPoses {
  double predicted_m = 0.0, tolerated_m = 0.0;
  NominalError nominal;
  UncheckedTouch unchecked;
  std::vector<double> contributions_m;  ///< of each line of the budget
};

/// Fills in parameters with covariance, unidentifiable directions, and predicted position errors.
void fill_accuracy(const Problem& problem, const Estimate& e, int region_poses, Calibration& c) {
  // Scatter beyond the stated noise widens every bound.
  const double inflation = std::max(1.0, c.chi2_per_dof);
  const Accuracy accuracy(problem, e, inflation, c);
  auto workspace = workspace_poses(problem.arm(), kFramePoses, kRegionSeed);
  const TipMoves stiff = accuracy.stiff_moves(workspace);
  Eigen::MatrixXd moves = aligned(stiff);
  const FrameDirections frame = find_frame_directions(problem, e.posterior.linear, stiff, moves);
  c.unidentifiable = frame.named;
  c.observability = observability(problem, e.posterior.linear, frame.basis_u);
  fill_parameters(problem, e, frame, inflation, c);
  if (region_poses != kFramePoses) {
    workspace = workspace_poses(problem.arm(), region_poses, kRegionSeed);
    moves = accuracy.moves(workspace);
  }
  const UncertaintyBudget budget(problem, e, inflation, c);
  const auto over = [&](const std::vector<JointVector>& poses, const Eigen::MatrixXd& its_moves) {
    const double predicted_m = accuracy.predicted_m(poses, its_moves);
    return OverPoses{predicted_m, accuracy.tolerated_m(poses, its_moves),
                     accuracy.nominal(poses, its_moves), least_checked_touch(problem, e, its_moves),
                     budget.contributions_m(poses, its_moves, predicted_m / kMeanOverRms)};
  };
  const OverPoses all = over(workspace, moves);
  const auto local = poses_near_targets(problem, c, region_poses);
  const OverPoses near = local.size() < kFewestPoses ? all : over(local, accuracy.moves(local));
  c.predicted_workspace_m = all.predicted_m;
  c.nominal_workspace_m = all.nominal.mean_m;
  c.nominal_workspace_u_m = all.nominal.u_m;
  c.tolerated_workspace_m = all.tolerated_m;
  c.unchecked_workspace = all.unchecked;
  c.predicted_near_targets_m = near.predicted_m;
  c.nominal_near_targets_m = near.nominal.mean_m;
  c.nominal_near_targets_u_m = near.nominal.u_m;
  c.tolerated_near_targets_m = near.tolerated_m;
  c.unchecked_near_targets = near.unchecked;
  const std::vector<UncertaintyLine> lines = budget.lines();
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double here_m = near.contributions_m[i], far_m = all.contributions_m[i];
    if (!(here_m > 0.0 || far_m > 0.0)) continue;
    c.uncertainty.push_back(lines[i]);
    c.uncertainty.back().near_targets_m = here_m;
    c.uncertainty.back().workspace_m = far_m;
  }
}

/// Fills in outliers and contradictions; `moves`, `jumps`: searches for moves and jumps as well.
void fill_consistency(const Problem& problem, const Estimate& e, bool moves, bool jumps,
                      Calibration& c) {
  const auto& touches = problem.touches();
  std::vector<bool> outlier(touches.size(), false);
  for (std::size_t i = 0; i < touches.size(); ++i)
    outlier[i] = touches[i].set == TouchSet::kFit && !e.use[i];
  for (const std::size_t i : gross_check_touches(problem, c)) outlier[i] = true;
  fill_residuals(problem, problem.to_si(e.u), outlier, c);
  const NormalEquations equations = normal_equations_without_lengths(problem, e);
  c.lengths = leave_one_out_lengths(problem, e, equations, c.chi2, c.degrees_of_freedom);
  c.artefact_biases = artefact_biases(problem, e, equations, c.chi2, c.degrees_of_freedom);
  c.outliers = named_outliers(problem, e, c);
  if (moves) c.moved = suspected_moves(problem, e, c.chi2_per_dof);
  if (jumps) c.jumped = suspected_jump(problem, e, c.chi2_per_dof);
}

/// Problem of a cell as stated, up to a model level.
struct Stated {
  Stated(const Cell& cell, const std::vector<Touch>& touches, const ModelLevel& fullest)
      : level(fullest),
        levelled(at_level(cell, fullest, touches)),
        arm(levelled),
        problem(levelled, arm, touches, starting_places(cell, arm, touches)),
        repeats(weigh_repeats(problem)) {}

  ModelLevel level;
  Cell levelled;
  ArmModel arm;
  Problem problem;
  Repeats repeats;
  bool learnt = false;         ///< has bearings or functions sized by these touches
  std::vector<Jump> jumped{};  ///< suspected without those, which may absorb a jump
};

/// Required gain of log evidence. Sizes were found from the same touches, which gains some by chance;
/// bearings have to be clear of what else the model lacks (iiwa14 at "raised_left" gains 10, and is
/// worse at unseen places; tests/real-data).
constexpr double kGainOfFunctions = 4.0, kGainOfBearings = 12.0;

bool states(const Robot& robot, double Joint::*sigma) {
  return std::ranges::any_of(robot.joints,
                             [sigma](const Joint& joint) { return joint.*sigma > 0.0; });
}

/// Levels with a ripple of their own where functions were identified from the touches, not stated in the
/// cell file.
std::vector<ModelLevel> levels_of(const Cell& cell, const Robot& robot, const ModelLevel& fullest) {
  const bool learnt =
      states(robot, &Joint::function_sigma_rad) && !states(cell.robot, &Joint::function_sigma_rad);
  const bool with_play = fullest.play > 0.0;
  return learnt ? levels_beside_functions(with_play) : usual_levels(with_play);
}

/// (27d). Adopts `richer` if its evidence is greater by more than the required gain.
bool adopt(std::unique_ptr<Stated> richer, double required_gain, const IdentifyOptions& options,
           const std::vector<ModelLevel>& levels, std::unique_ptr<Stated>& likely, Estimate& e) {
  try {
    if (!(evidence_gain(likely->problem, richer->problem, e) > required_gain)) return false;
    e = estimate_richer(likely->problem, richer->problem, options, levels, e);
  } catch (const IdentifyError&) {
    return false;
  }
  richer->learnt = true;
  richer->jumped = std::move(likely->jumped);
  likely = std::move(richer);
  return true;
}

/// Adds compliance of the joints across their axes, if the touches show it.
void add_bearings(const Cell& cell, const std::vector<Touch>& touches,
                  const IdentifyOptions& options, std::unique_ptr<Stated>& likely, Estimate& e) {
  constexpr double kShares[] = {0.3, 0.1};  // of the prior about the axis
  const auto richer = [&](double share) {
    return std::make_unique<Stated>(
        with_learnt_of(with_bearings(likely->levelled.robot, share), cell), touches, likely->level);
  };
  std::unique_ptr<Stated> best = richer(kShares[0]);
  if (best->problem.size() == likely->problem.size() ||
      !speaks_for(likely->problem, best->problem, e))
    return;
  try {
    std::unique_ptr<Stated> other = richer(kShares[1]);
    if (evidence_gain(likely->problem, other->problem, e) >
        evidence_gain(likely->problem, best->problem, e))
      best = std::move(other);
  } catch (const IdentifyError&) {
    return;
  }
  adopt(std::move(best), kGainOfBearings, options,
        levels_of(cell, likely->levelled.robot, likely->level), likely, e);
}

/// Sizes above are no gear's, 1.5 mm at 1 m: a file or the touches are wrong.
bool has_gears(const Robot& robot) {
  constexpr double kLargestRad = 300.0 * kRadPerArcsec;
  return std::ranges::all_of(robot.joints, [](const Joint& joint) {
    return joint.function_sigma_rad <= kLargestRad &&
           joint.function_fast_sigma_rad <= kLargestRad &&
           std::ranges::all_of(joint.waves,
                               [](const JointWave& wave) { return wave.sigma_rad <= kLargestRad; });
  });
}

/// Adds functions of the joint angles, single waves of the joints, and where there are none of those
/// fast orders to the functions, if the touches show them.
void add_functions(const Cell& cell, const std::vector<Touch>& touches,
                   const IdentifyOptions& options, std::unique_ptr<Stated>& likely, Estimate& e) {
  const auto add = [&](const Robot& robot, double required_gain) {
    return has_gears(robot) &&
           adopt(std::make_unique<Stated>(with_learnt_of(robot, cell), touches, likely->level),
                 required_gain, options, levels_of(cell, robot, likely->level), likely, e);
  };
  bool functions = false;
  if (const auto sized = size_functions(likely->problem, likely->repeats, e)) {
    if (!has_gears(*sized)) return;
    functions = add(*sized, kGainOfFunctions);
  }
  const FoundWaves waves = find_waves(likely->problem, e);
  if ((waves.count > 0 && add(waves.robot, waves.required_gain)) || !functions) return;
  if (const auto faster = size_fast_orders(likely->problem, likely->repeats, e)) add(*faster, 0.0);
}

/// True if the touches contradict a certified length or a size: a richer arm would absorb it.
bool contradicts_files(const Problem& problem, const Estimate& e, const Calibration& fit) {
  const NormalEquations equations = normal_equations_without_lengths(problem, e);
  return worst_contradicted(leave_one_out_lengths(problem, e, equations, fit.chi2,
                                                  fit.degrees_of_freedom)) != nullptr ||
         worst_contradicted(
             artefact_biases(problem, e, equations, fit.chi2, fit.degrees_of_freedom)) != nullptr;
}

/// The model decided on by `decided`, with the estimate of all touches.
std::unique_ptr<Stated> with_all_touches(const Cell& cell, const std::vector<Touch>& touches,
                                         const IdentifyOptions& options, const Stated& decided,
                                         Estimate& e) {
  const Robot& robot = decided.levelled.robot;
  auto all = std::make_unique<Stated>(with_learnt_of(robot, cell), touches, decided.level);
  all->learnt = decided.learnt;
  e = estimate(all->problem, options, levels_of(cell, robot, decided.level));
  return all;
}

/// Starts with the fullest level without play: outliers are tested against a model that explains
/// nearly all errors of an arm, and the evidence of every simpler level follows from its
/// linearisation.
std::unique_ptr<Stated> likeliest(const Cell& cell, const std::vector<Touch>& touches,
                                  const IdentifyOptions& options, bool richer, Estimate& e) {
  if (richer)
    if (const std::vector<Touch> some = of_one_tool_per_posture(touches);
        some.size() < touches.size())
      return with_all_touches(cell, touches, options, *likeliest(cell, some, options, true, e), e);
  auto likely = std::make_unique<Stated>(cell, touches, options.level.value_or(ModelLevel{}));
  std::vector<ModelLevel> levels = usual_levels();
  if (options.level)
    levels = {{1.0, 1.0, options.level->ripple_rad, options.level->play > 0.0 ? 1.0 : 0.0}};
  e = estimate(likely->problem, options, std::move(levels));
  if (options.level) return likely;
  auto played = std::make_unique<Stated>(cell, touches, kFullestLevel);
  if (!options.with_discrepancy && estimate_with_play(likely->problem, played->problem, options, e))
    likely = std::move(played);
  if (!richer) return likely;
  Calibration fit;
  fill_fit(likely->problem, e, likely->repeats, fit);
  if (contradicts_files(likely->problem, e, fit)) return likely;
  likely->jumped = suspected_jump(likely->problem, e, fit.chi2_per_dof);
  if (options.functions && !has_functions(cell.robot))
    add_functions(cell, touches, options, likely, e);
  // After the functions: of gears with waves, 100 touches took bearings for these.
  if (!states(cell.robot, &Joint::bearing_sigma_rad_per_nm))
    add_bearings(cell, touches, options, likely, e);
  return likely;
}

std::vector<std::string> touched_loads(const Cell& cell, const std::vector<Touch>& touches) {
  std::set<std::string> loads;
  for (const Touch& touch : touches)
    if (!cell.loads.empty() && touch.set == TouchSet::kFit) loads.insert(touch.load);
  return {loads.begin(), loads.end()};
}

}  // namespace

void require_sound(const Cell& cell, const std::vector<Touch>& touches) {
  std::vector<bool> fitted(cell.targets.size(), false);
  for (std::size_t i = 0; i < touches.size(); ++i) {
    if (touches[i].set == TouchSet::kFit) fitted[cell.target_index(touches[i].target)] = true;
    std::vector<double> angles = touches[i].joint_rad;
    angles.insert(angles.end(), touches[i].positioner_rad.begin(), touches[i].positioner_rad.end());
    for (const double angle : angles)
      if (!std::isfinite(angle)) {
        IdentifyError error(
            IdentifyError::Kind::kTouches, touches[i].target,
            fmt::format("{} of {} has a joint angle that is not a number; leave it out",
                        touch_words(i, touches[i]), touches.size()));
        error.touch = i;
        throw error;
      }
  }
  if (std::none_of(fitted.begin(), fitted.end(), [](bool any) { return any; }))
    throw IdentifyError(IdentifyError::Kind::kUndetermined,
                        "there are no fit touches; nothing to identify from");
}

Calibration not_identified(const Cell& cell, const std::vector<Touch>& touches,
                           const IdentifyOptions& options, const std::string& why) {
  constexpr double kAnywhere = 100.0;  // for unknowns without a prior, in their scales
  const Cell levelled = at_level(cell, options.level.value_or(ModelLevel{}), touches);
  const ArmModel arm(levelled);
  const Problem problem(levelled, arm, touches, rough_places(cell, arm, touches));
  Estimate e;
  e.u = Eigen::VectorXd::Zero(problem.size());
  e.posterior.covariance_u = Eigen::MatrixXd::Zero(problem.size(), problem.size());
  for (int i = 0; i < problem.size(); ++i) {
    const double weight = problem.unknowns()[i].prior_weight;
    e.posterior.covariance_u(i, i) = std::pow(weight > 0.0 ? 1.0 / weight : kAnywhere, 2);
  }
  e.levels.transmission = e.levels.compliance = 1.0;

  Calibration calibration;
  calibration.cell = cell;
  calibration.region = tracker_region(cell, touches);
  calibration.level = options.level.value_or(ModelLevel{});
  calibration.level_reason = {LevelChoice::kNothingIdentified};
  const FrameDirections no_frame{Eigen::MatrixXd(problem.size(), 0), {}};
  fill_parameters(problem, e, no_frame, 1.0, calibration);
  for (ParameterResult& p : calibration.parameters) p.decided_by = DecidedBy::kPrior;
  const Eigen::VectorXd scale = problem.scales();
  const Eigen::VectorXd x = problem.to_si(e.u);
  const Eigen::MatrixXd covariance = e.posterior.covariance_u.topLeftCorner(arm.size(), arm.size());
  const auto predicted_m = [&](const std::vector<JointVector>& poses) {
    return poses.size() < kFewestPoses
               ? calibration.predicted_workspace_m
               : predicted_mean_error_m(aligned_moves(arm, poses, x.data(), scale), covariance,
                                        ripple_variance_m2(arm, poses, 0.0));
  };
  calibration.predicted_workspace_m =
      predicted_m(workspace_poses(arm, options.region_poses, kRegionSeed));
  calibration.predicted_near_targets_m =
      predicted_m(poses_near_targets(problem, calibration, options.region_poses));
  fill_residuals(problem, x, std::vector<bool>(touches.size(), false), calibration);
  Finding finding{FindingKind::kNotIdentified, Severity::kWithholds};
  finding.text = why;
  calibration.verdict.add(std::move(finding));
  return calibration;
}

Calibration identify_single_pass(const Cell& cell, const std::vector<Touch>& touches,
                                 const IdentifyOptions& options, bool richer) {
  require_sound(cell, touches);
  Estimate e;
  const std::unique_ptr<Stated> likely = likeliest(cell, touches, options, richer, e);
  Problem& problem = likely->problem;
  const bool together = options.with_discrepancy && !options.level;
  Calibration calibration;
  if (together) calibration.discrepancy = estimate_together(problem, options, likely->repeats, e);
  const LevelMean& mean = e.levels;

  calibration.cell = cell;
  if (likely->learnt)
    calibration.cell = with_learnt_of(likely->levelled.robot, std::move(calibration.cell));
  calibration.level = options.level.value_or(
      ModelLevel{1.0, mean.transmission, mean.ripple_rad, likely->level.play});
  calibration.levels = mean.levels;
  calibration.log_evidence = log_evidence(problem, e);
  if (options.level) calibration.levels.front().level = *options.level;
  calibration.level_reason = {options.level ? LevelChoice::kAskedFor
                                            : LevelChoice::kMeanByEvidence};
  fill_fit(problem, e, likely->repeats, calibration);
  calibration.region = tracker_region(cell, touches, e.use);
  double shared_m = calibration.discrepancy.sigma_m;
  if (!together && !options.level) {
    if (calibration.touch_noise_m > kNothingM)
      calibration.discrepancy.alike = alike_sigmas(problem, e, calibration.chi2_per_dof);
    const UndetectedErrors errors = undetected_errors(problem, e, likely->repeats);
    calibration.discrepancy.sigma_m = errors.field_m;
    shared_m = errors.shared_m;
  }
  Eigen::MatrixXd as_found = e.posterior.covariance_u;
  if (!calibration.region.empty() && !options.level && options.functions &&
      !has_functions(problem.arm().robot())) {
    const SharedErrors shared = shared_errors(problem, e);
    as_found += std::pow(calibration.discrepancy.sigma_m, 2) * shared.covariance_u;
    e.posterior.covariance_u += shared.absorbed * shared_m * shared_m * shared.covariance_u;
  }
  calibration.touched_loads = touched_loads(cell, touches);
  fill_accuracy(problem, e, options.region_poses, calibration);
  // Errors that the fit absorbed may be a move or a jump, which is therefore sought against those found.
  e.posterior.covariance_u = as_found;
  // Not with a discrepancy, for which they were sought before: the model error resembles moves and
  // jumps, and properties that a specified level omits resemble jumps.
  fill_consistency(problem, e, !together, !together && !options.level, calibration);
  if (calibration.jumped.empty() && likely->learnt && !together)
    calibration.jumped = likely->jumped;
  calibration.positioner = positioner_lines(calibration, touches);
  calibration.linear_unit = linear_unit_line(calibration, touches);
  calibration.verdict = judge(problem, calibration);
  return calibration;
}

std::variant<Calibration, IdentifyError> identified_or_why_not(const Cell& cell,
                                                               const std::vector<Touch>& touches,
                                                               const IdentifyOptions& options,
                                                               bool richer) {
  try {
    return identify_single_pass(cell, touches, options, richer);
  } catch (const IdentifyError& why_not) {
    return why_not;
  }
}

}  // namespace cellcal::calib
