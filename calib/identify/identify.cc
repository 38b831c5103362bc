#include "calib/identify/identify.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>

#include "calib/identify/evidence.h"
#include "calib/identify/frame.h"
#include "calib/identify/problem.h"
#include "calib/identify/region.h"
#include "calib/identify/residuals.h"
#include "calib/identify/solve.h"
#include "calib/identify/target_place.h"
#include "calib/identify/verdict.h"

namespace cellcal::calib {

namespace {

/// Cauchy's loss at two sigma: full weight for honest touches, next to none for gross ones.
constexpr double kCauchySigma = 2.0;
constexpr int kOutlierRounds = 20;
constexpr int kWorkspacePoses = 100;
constexpr int kLocalPoses = 100;
constexpr double kLocalHalfM = 0.150;
constexpr unsigned kRegionSeed = 20240924;

/// What is known at an estimate: covariance in prior units, and how much each touch holds itself.
struct Posterior {
  Linearisation linear;
  Eigen::MatrixXd covariance_u;
  Eigen::VectorXd leverage;  ///< per row of the linearisation: j S j'
};

/// j S j' of every row.
Eigen::VectorXd spread(const RowMajor& j, const Eigen::MatrixXd& covariance) {
  Eigen::VectorXd result(j.rows());
  constexpr Eigen::Index kRows = 128;  // stays in the cache
  for (Eigen::Index first = 0; first < j.rows(); first += kRows) {
    const auto rows = j.middleRows(first, std::min(kRows, j.rows() - first));
    result.segment(first, rows.rows()) = (rows * covariance).cwiseProduct(rows).rowwise().sum();
  }
  return result;
}

Posterior posterior_at(const Problem& problem, const Eigen::VectorXd& u,
                       const std::vector<bool>& use, Eigen::MatrixXd covariance_u) {
  Posterior p{linearise(problem, u, use), std::move(covariance_u), {}};
  p.leverage = spread(p.linear.jacobian, p.covariance_u);
  return p;
}

/// At the problem's own level.
Posterior posterior_at(const Problem& problem, const Eigen::VectorXd& u,
                       const std::vector<bool>& use) {
  const ModelLevel own[] = {{}};
  Posterior p{linearise(problem, u, use), {}, {}};
  p.covariance_u = mean_over_levels(problem, u, p.linear, own).covariance_u;
  p.leverage = spread(p.linear.jacobian, p.covariance_u);
  return p;
}

/// |r| / sigma with the touch's own pull on the fit taken out (studentised), for used touches;
/// with the fit's uncertainty added, for the others.
std::vector<double> studentised(const Problem& problem, const Eigen::VectorXd& u,
                                const std::vector<bool>& fit, const std::vector<bool>& use,
                                const Posterior& posterior) {
  const std::size_t count = problem.touches().size();
  std::vector<double> t(count, 0.0);
  for (const auto& [touch, row] : posterior.linear.touch_row) {
    const int rows = problem.rows(touch);
    double worst = 0.0;
    for (int k = 0; k < rows; ++k) {
      constexpr double kLeast =
          1e-6;  // a touch that alone decides something says nothing of itself
      const double free = 1.0 - posterior.leverage[row + k];
      if (free > kLeast)
        worst = std::max(worst, std::abs(posterior.linear.residual[row + k]) / std::sqrt(free));
    }
    t[touch] = worst;
  }
  std::vector<bool> others(count, false);
  for (std::size_t i = 0; i < count; ++i) others[i] = fit[i] && !use[i];
  const Linearisation outside = linearise(problem, u, others);
  const Eigen::VectorXd predicted = spread(outside.jacobian, posterior.covariance_u);
  for (const auto& [touch, row] : outside.touch_row) {
    double worst = 0.0;
    for (int k = 0; k < problem.rows(touch); ++k)
      worst = std::max(worst,
                       std::abs(outside.residual[row + k]) / std::sqrt(1.0 + predicted[row + k]));
    t[touch] = worst;
  }
  return t;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Estimate {
  Eigen::VectorXd u;
  std::vector<bool> use;
  Posterior posterior;
};

std::vector<bool> fit_touches(const Problem& problem) {
  std::vector<bool> fit(problem.touches().size());
  for (std::size_t i = 0; i < fit.size(); ++i) fit[i] = problem.touches()[i].set == TouchSet::kFit;
  return fit;
}

/// The fit touches that agree with the estimate; judges those left out by it, too.
std::vector<bool> honest_touches(const Problem& problem, const IdentifyOptions& options,
                                 const Estimate& e) {
  const std::vector<bool> fit = fit_touches(problem);
  const std::vector<double> t = studentised(problem, e.u, fit, e.use, e.posterior);
  std::vector<double> used;
  for (std::size_t i = 0; i < t.size(); ++i)
    if (fit[i]) used.push_back(t[i]);
  // More scatter than stated widens the gate instead of throwing good touches away.
  constexpr double kMadToSigma = 1.4826;
  const double gate = options.outlier_sigma * std::max(1.0, kMadToSigma * median(used));
  std::vector<bool> honest = fit;
  for (std::size_t i = 0; i < t.size(); ++i)
    if (fit[i] && t[i] > gate) honest[i] = false;
  return honest;
}

/// A share of many touches that is enough to come near the solution, spread over each target's.
std::vector<bool> enough_of(const Problem& problem, const std::vector<bool>& use) {
  constexpr std::size_t kEnough = 2000;
  if (static_cast<std::size_t>(std::count(use.begin(), use.end(), true)) <= 2 * kEnough) return use;
  const std::size_t share = kEnough / problem.blocks().size() + 1;
  std::vector<std::size_t> of_target(problem.blocks().size(), 0), seen = of_target;
  for (std::size_t i = 0; i < use.size(); ++i)
    if (use[i]) ++of_target[static_cast<std::size_t>(problem.block_of(i))];
  std::vector<bool> some(use.size(), false);
  for (std::size_t i = 0; i < use.size(); ++i) {
    if (!use[i]) continue;
    const auto block = static_cast<std::size_t>(problem.block_of(i));
    const std::size_t every = std::max<std::size_t>(1, of_target[block] / share);
    some[i] = seen[block]++ % every == 0;
  }
  return some;
}

/// Comes near the solution from zero errors: touches are first taken as worth a millimetre, then
/// ever more. Taking them at their word at once would let what the linearisation gets wrong (parts
/// in a thousand of the errors) drive the directions that the touches hardly see. Robust, so that
/// gross outliers do not lead astray; those are named before anything is fitted without protection.
void approach(const Problem& problem, const IdentifyOptions& options, Estimate& e) {
  constexpr double kFirstFloorM = 1e-3, kStep = 10.0;
  const std::vector<bool> all = e.use;
  e.use = enough_of(problem, all);
  double finest = kFirstFloorM;
  for (std::size_t i = 0; i < e.use.size(); ++i)
    if (e.use[i]) finest = std::min(finest, problem.sigma_m(i));
  for (double floor = kFirstFloorM; floor > finest; floor /= kStep)
    e.u =
        solve(problem, e.u,
              {e.use, options.reject_outliers ? kCauchySigma : 0.0, options.max_iterations, floor})
            .u;
  if (!options.reject_outliers) {
    e.use = all;
    return;
  }
  e.u = solve(problem, e.u, {e.use, kCauchySigma, options.max_iterations, finest}).u;
  e.posterior = posterior_at(problem, e.u, e.use);
  e.use = honest_touches(problem, options, e);
}

/// Where the last stretch was too long for the solver: the same again in small steps, every one of
/// them to its end. Seldom needed; where the touches are free of noise and say little of some
/// unknown.
void approach_slowly(const Problem& problem, const IdentifyOptions& options, Estimate& e) {
  constexpr double kFirstFloorM = 1e-3, kStep = 3.0;
  double finest = kFirstFloorM;
  for (std::size_t i = 0; i < e.use.size(); ++i)
    if (e.use[i]) finest = std::min(finest, problem.sigma_m(i));
  e.u.setZero();
  for (double floor = kFirstFloorM; floor > finest; floor /= kStep)
    e.u = solve(problem, e.u, {e.use, 0.0, options.max_iterations, floor}).u;
}

/// Solves and names outliers in turn until the set of touches in use no longer changes. Touches
/// once thrown out may come back.
void settle(const Problem& problem, const IdentifyOptions& options, Estimate& e) {
  for (int round = 0; round < kOutlierRounds; ++round) {
    SolveResult solved = solve(problem, e.u, {e.use, 0.0, options.max_iterations, 0.0});
    if (!solved.converged) {
      approach_slowly(problem, options, e);
      solved = solve(problem, e.u, {e.use, 0.0, options.max_iterations, 0.0});
    }
    if (!solved.converged)
      throw IdentifyError(
          fmt::format("the estimate did not converge in {} iterations; are the "
                      "robot file and the touches of the same arm?",
                      options.max_iterations));
    e.u = solved.u;
    e.posterior = posterior_at(problem, e.u, e.use);
    if (!options.reject_outliers) return;
    std::vector<bool> next = honest_touches(problem, options, e);
    if (next == e.use) return;
    e.use = std::move(next);
  }
}

/// From the fullest level's solution to the mean over all levels, and the outliers by that. Each
/// round is one Gauss-Newton step of every level; levels without a say are not asked again.
/// `problem` and e.posterior have the mean's ripple in the end.
LevelMean settle_over_levels(Problem& problem, const IdentifyOptions& options,
                             std::vector<ModelLevel> levels, Estimate& e) {
  // In prior sigmas. What a step of this size leaves undone is a thousandth of it: the errors are
  // milliradians, and the next term of the expansion is smaller by that.
  constexpr double kStep = 1e-2;
  constexpr double kNoSay = 1e-6;
  LevelMean first;
  for (int round = 0;; ++round) {
    LevelMean mean = mean_over_levels(problem, e.u, e.posterior.linear, levels);
    const double step = (mean.u - e.u).lpNorm<Eigen::Infinity>();
    e.u = mean.u;
    problem.set_ripple(mean.ripple_rad);
    e.posterior = posterior_at(problem, e.u, e.use, mean.covariance_u);
    std::vector<bool> next = e.use;
    if (options.reject_outliers) next = honest_touches(problem, options, e);
    if ((next == e.use && step < kStep) || round == kOutlierRounds) {
      std::vector<LevelEvidence> shown = std::move(mean.levels);
      for (const LevelEvidence& l : first.levels)
        if (std::none_of(shown.begin(), shown.end(),
                         [&](const LevelEvidence& other) { return other.level == l.level; }))
          shown.push_back(l);
      mean.levels = std::move(shown);
      return mean;
    }
    if (next != e.use) {
      e.use = std::move(next);
      e.posterior.linear = linearise(problem, e.u, e.use);
    }
    if (round == 0) {
      levels.clear();
      for (const LevelEvidence& l : mean.levels)
        if (l.probability > kNoSay) levels.push_back(l.level);
      first = std::move(mean);
    }
  }
}

void fill_parameters(const Problem& problem, const Estimate& e, const FrameDirections& frame,
                     double inflation, double transmission, Calibration& calibration) {
  const Eigen::VectorXd x = problem.to_si(e.u);
  const int n = problem.size();
  Eigen::VectorXd scale(n);
  for (int i = 0; i < n; ++i) scale[i] = problem.unknowns()[i].scale;
  calibration.covariance =
      inflation * (scale.asDiagonal() * e.posterior.covariance_u * scale.asDiagonal());
  calibration.frame_basis = scale.asDiagonal() * frame.basis_u;
  for (int i = 0; i < n; ++i) {
    const Unknown& unknown = problem.unknowns()[i];
    ParameterResult p{unknown.name,           unknown.unit,
                      unknown.to_unit,        unknown.nominal,
                      x[i] - unknown.nominal, std::sqrt(calibration.covariance(i, i))};
    // Who decided it: the frame where half of its variance is the frame's; the prior where the
    // touches took less than half of the prior's variance away, or no level with a say has it at
    // all.
    const double variance_u = e.posterior.covariance_u(i, i);
    const double of_frame = frame.basis_u.cols() > 0 ? frame.basis_u.row(i).squaredNorm() : 0.0;
    double prior_u = unknown.prior_weight > 0.0 ? 1.0 / unknown.prior_weight : 1e9;
    if (i < problem.arm_size()) {
      const ArmParameterKind kind = problem.arm().parameters()[i].kind;
      if (kind == ArmParameterKind::kCosine || kind == ArmParameterKind::kSine)
        prior_u *= transmission;  // of the levels, each as far as it is believed
    }
    if (of_frame * std::min(1.0, prior_u * prior_u) > 0.5 * variance_u)
      p.decided_by = DecidedBy::kFrame;
    else if (variance_u > 0.5 * prior_u * prior_u || variance_u == 0.0)
      p.decided_by = DecidedBy::kPrior;
    calibration.parameters.push_back(p);
  }
  for (const TargetBlock& block : problem.blocks()) {
    const Target& target = problem.cell().targets[block.target];
    TargetResult result = result_at(target, problem.place(block), x.data() + block.first);
    if (target.kind == TargetKind::kSphere || target.kind == TargetKind::kPlane)
      result.effective_radius_m = problem.nominal_radius_m(target) +
                                  (problem.rho() >= 0 ? x[problem.rho()] : 0.0) +
                                  (block.has_radius ? x[block.first + block.place] : 0.0);
    calibration.targets.push_back(result);
  }
}

std::vector<JointVector> poses_near_targets(const Problem& problem,
                                            const std::vector<TargetResult>& targets) {
  std::vector<JointVector> around;
  for (const Touch& touch : problem.touches()) around.push_back(touch.joint_rad);
  std::vector<Eigen::Vector3d> centres;
  for (const TargetResult& target : targets) {
    if (has_a_centre(target.kind)) {
      centres.push_back(target.centre_m);
      continue;
    }
    for (std::size_t i = 0; i < problem.touches().size(); ++i)  // it is where it was touched
      if (problem.touches()[i].target == target.id)
        centres.push_back(problem.arm().position(problem.pose(i), nullptr));
  }
  return local_poses(problem.arm(), around, centres, kLocalHalfM, kLocalPoses, kRegionSeed);
}

std::string level_reason(const Cell& cell, const ModelLevel& level, const LevelMean& mean,
                         bool given) {
  if (given) return words(cell, level) + "; as asked for";
  double compliance = 0.0;
  for (const LevelEvidence& l : mean.levels)
    compliance += l.level.compliance > 0.0 ? l.probability : 0.0;
  return fmt::format(
      "{}; mean over {} levels, each by its evidence. Joint compliance is in it at {:.0f} %. The "
      "likeliest level, at {:.0f} %: {}",
      words(cell, level), mean.levels.size(), 100.0 * compliance,
      100.0 * mean.levels.front().probability, words(cell, mean.levels.front().level));
}

}  // namespace

Calibration identify_as_stated(const Cell& cell, const std::vector<Touch>& touches,
                               const IdentifyOptions& options) {
  const bool any_fit = std::any_of(touches.begin(), touches.end(),
                                   [](const Touch& t) { return t.set == TouchSet::kFit; });
  if (!any_fit) throw IdentifyError("there are no fit touches; nothing to identify from");
  for (std::size_t i = 0; i < touches.size(); ++i)
    for (const double angle : touches[i].joint_rad)
      if (!std::isfinite(angle))
        throw IdentifyError(
            fmt::format("touch {} of {} has a joint angle that is not a number; leave it out",
                        i + 1, touches.size()));

  // The fullest level first: outliers are judged by a model that can explain all that an arm does,
  // and the evidence of every simpler level follows from its linearisation.
  const Cell levelled = at_level(cell, options.level.value_or(ModelLevel{}));
  const ArmModel arm(levelled.robot, levelled.tool);
  const auto places = starting_places(cell, arm, touches);
  Problem problem(levelled, arm, touches, places);
  for (std::size_t i = 0; i < touches.size(); ++i)
    if (problem.block_of(i) < 0)
      throw IdentifyError(fmt::format(
          "target {} has check touches but no fit touch; its centre is unknown. Make some of its "
          "touches fit touches, or leave it out",
          touches[i].target));
  Estimate e;
  e.use = fit_touches(problem);
  e.u = Eigen::VectorXd::Zero(problem.size());
  approach(problem, options, e);
  settle(problem, options, e);

  std::vector<ModelLevel> levels = usual_levels();
  if (options.level) levels = {{1.0, 1.0, options.level->ripple_rad}};
  const LevelMean mean = settle_over_levels(problem, options, std::move(levels), e);

  Calibration calibration;
  calibration.cell = cell;
  calibration.level = options.level.value_or(ModelLevel{1.0, mean.transmission, mean.ripple_rad});
  calibration.levels = mean.levels;
  if (options.level) calibration.levels.front().level = *options.level;
  calibration.level_reason = level_reason(cell, calibration.level, mean, options.level.has_value());
  double sum = 0.0, held = 0.0, noise = 0.0;
  for (const auto& [touch, row] : e.posterior.linear.touch_row)
    for (int k = 0; k < problem.rows(touch); ++k) {
      sum += std::pow(e.posterior.linear.residual[row + k], 2);
      noise += std::pow(e.posterior.linear.residual[row + k] * problem.sigma_m(touch), 2);
      held += 1.0 - e.posterior.leverage[row + k];
    }
  const double dof = std::max(held, 1.0);
  calibration.chi2_per_dof = sum / dof;
  calibration.touch_noise_m = std::sqrt(noise / dof);
  // Scatter beyond the stated noise is not explained away: it widens every bound.
  const double inflation = std::max(1.0, calibration.chi2_per_dof);

  Eigen::VectorXd scale(arm.size());
  for (int i = 0; i < arm.size(); ++i) scale[i] = problem.unknowns()[i].scale;
  const Eigen::VectorXd x = problem.to_si(e.u);
  const auto workspace = workspace_poses(arm, kWorkspacePoses, kRegionSeed);
  const Eigen::MatrixXd moves = aligned_moves(arm, workspace, x.data(), scale);
  const FrameDirections frame = find_frame_directions(problem, e.posterior.linear, moves);
  calibration.unidentifiable = frame.words;
  fill_parameters(problem, e, frame, inflation, options.level ? 1.0 : mean.transmission,
                  calibration);
  const Eigen::MatrixXd arm_covariance =
      inflation * e.posterior.covariance_u.topLeftCorner(arm.size(), arm.size());
  calibration.predicted_m3_m = predicted_mean_error_m(moves, arm_covariance);
  const auto local = poses_near_targets(problem, calibration.targets);
  if (local.size() >= 3)
    calibration.predicted_m2_m =
        predicted_mean_error_m(aligned_moves(arm, local, x.data(), scale), arm_covariance);

  std::vector<bool> outlier(touches.size(), false);
  for (std::size_t i = 0; i < touches.size(); ++i)
    outlier[i] = touches[i].set == TouchSet::kFit && !e.use[i];
  fill_residuals(problem, problem.to_si(e.u), outlier, calibration);
  for (const TouchResidual& r : calibration.residuals)
    if (r.outlier)
      calibration.outliers.push_back(
          {r.touch, r.after_m,
           fmt::format("{:+.3f} mm off {}, {:.0f} times the touch noise{}", r.after_m * 1e3,
                       touches[r.touch].target, std::abs(r.whitened),
                       problem.rows(r.touch) == 3 ? ""  // a distance, to no side
                       : r.after_m > 0 ? " (tip outside: contact seen before the surface)"
                                       : " (tip inside: contact seen too late)")});
  calibration.verdict = judge(problem, calibration);
  return calibration;
}

}  // namespace cellcal::calib
