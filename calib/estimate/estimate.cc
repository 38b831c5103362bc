#include "calib/estimate/estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/estimate/relaxation.h"
#include "calib/model/error.h"
#include "calib/model/linear.h"

namespace cellcal::calib {

// Outliers: fit touches with a studentised residual beyond the gate. They are excluded from the
// estimate, tested again at each step, and may be readmitted.

namespace {

/// Studentised residual of a touch: |r| / sigma, with its own influence on the fit removed for used
/// touches and the uncertainty of the fit added for the others.
struct Studentised {
  double sigmas = 0.0;
  /// Leverage of an excluded touch if readmitted, j S j' / (1 + j S j'). Near 1 no other
  /// touch determines its direction, and a small residual is no evidence in its favour.
  double own = 0.0;
};

std::vector<Studentised> studentised(const Problem& problem, const Eigen::VectorXd& u,
                                     const std::vector<bool>& fit, const std::vector<bool>& use,
                                     const Posterior& posterior) {
  const std::size_t count = problem.touches().size();
  std::vector<Studentised> off(count);
  for (const auto& [touch, row] : posterior.linear.touch_row) {
    for (int k = row; k < row + problem.rows(touch); ++k) {
      constexpr double kLeast =
          1e-6;  // a touch that alone determines something gives no information on itself
      const double free = 1.0 - posterior.leverage[k];  // (20), used
      if (free > kLeast)
        off[touch].sigmas =
            std::max(off[touch].sigmas, std::abs(posterior.linear.residual[k]) / std::sqrt(free));
    }
  }
  std::vector<bool> others(count, false);
  for (std::size_t i = 0; i < count; ++i) others[i] = fit[i] && !use[i];
  const Linearisation outside = linearise(problem, u, others);
  // (20), left out
  const Eigen::VectorXd predicted = leverage_of(outside.jacobian, posterior.covariance_u);
  for (const auto& [touch, row] : outside.touch_row) {
    for (int k = row; k < row + problem.rows(touch); ++k) {
      off[touch].sigmas = std::max(off[touch].sigmas,
                                   std::abs(outside.residual[k]) / std::sqrt(1.0 + predicted[k]));
      off[touch].own = std::max(off[touch].own, predicted[k] / (1.0 + predicted[k]));  // (22)
    }
  }
  return off;
}

/// Studentised residuals of all fit touches; sets e.gate.
std::vector<Studentised> studentise_and_set_gate(const Problem& problem,
                                                 const std::vector<bool>& fit, Estimate& e) {
  std::vector<Studentised> off = studentised(problem, e.u, fit, e.use, e.posterior);
  // For a point or a tracker the largest of three components counts, whose median is 1.26 sigma:
  // their gate is wider. Seated or hand-held measurements have heavier tails (a gate by the median
  // of three made panda_1 of the measured data worse).
  std::vector<double> scatter;
  for (std::size_t i = 0; i < off.size(); ++i)
    if (fit[i]) scatter.push_back(off[i].sigmas / kNormalMedian);
  // Scatter above the stated noise widens the gate instead of rejecting good touches.
  e.gate = kOutlierSigma * std::max(1.0, median(scatter));  // (21)
  return off;
}

/// Selects outliers iteratively.
///
/// Among excluded touches of a target that no other touch determines only one is readmitted at a
/// time, and the others are tested against it: together they would always agree with themselves.
///
/// A touch with a leverage near 1 may be rejected while it is used and accepted while it is not. On
/// its second readmission it is settled permanently by its residual relative to the others, and
/// stays excluded in doubt: a gross error in the fit does more harm than a missing good touch.
class OutlierRejection {
 public:
  OutlierRejection(const Problem& problem, const IdentifyOptions& options)
      : options_(options),
        fit_(fit_touches(problem)),
        came_back_(fit_.size(), false),
        settled_(fit_.size(), false) {}

  /// Updates e.use and returns true if it changed. `near`: the estimate is close enough to the
  /// solution for permanent decisions.
  bool changed(const Problem& problem, Estimate& e, bool near) {
    if (!options_.reject_outliers) return false;
    constexpr double kInDoubt = 0.5;       // of the gate
    constexpr double kUndetermined = 0.9;  // leverage
    const std::vector<Studentised> off = studentise_and_set_gate(problem, fit_, e);
    const std::vector<std::size_t> first = first_undetermined(problem, e, off, kUndetermined);
    bool any = false;
    for (std::size_t i = 0; i < off.size(); ++i) {
      if (!fit_[i] || settled_[i]) continue;
      bool inlier = off[i].sigmas <= e.gate;
      if (inlier && !e.use[i]) {
        if (off[i].own > kUndetermined && first[static_cast<std::size_t>(problem.block_of(i))] != i)
          continue;
        if (near && came_back_[i]) {
          settled_[i] = true;
          inlier = off[i].sigmas <= kInDoubt * e.gate;
        }
        came_back_[i] = came_back_[i] || near;
      }
      any |= inlier != e.use[i];
      e.use[i] = inlier;
    }
    return any;
  }

 private:
  /// Per target block, the excluded touch of least residual among those that no other touch
  /// determines; the number of touches if there is none.
  std::vector<std::size_t> first_undetermined(const Problem& problem, const Estimate& e,
                                              const std::vector<Studentised>& off,
                                              double own) const {
    std::vector<std::size_t> first(problem.blocks().size(), off.size());
    for (std::size_t i = 0; i < off.size(); ++i) {
      if (!fit_[i] || settled_[i] || e.use[i] || off[i].own <= own) continue;
      std::size_t& least = first[static_cast<std::size_t>(problem.block_of(i))];
      if (least == off.size() || off[i].sigmas < off[least].sigmas) least = i;
    }
    return first;
  }

  const IdentifyOptions& options_;
  std::vector<bool> fit_, came_back_, settled_;
};

/// Scale of Cauchy's loss: nearly full weight for good touches, almost none for gross errors.
constexpr double kCauchySigma = 2.0;
constexpr int kOutlierRounds = 20;
/// Sigma floor of the touches at the start.
constexpr double kFirstFloorM = 1e-3;

void set_covariance(Eigen::MatrixXd covariance_u, Posterior& posterior) {
  posterior.covariance_u = std::move(covariance_u);
  posterior.leverage = leverage_of(posterior.linear.jacobian, posterior.covariance_u);
}

/// Posterior at the problem's own level.
void find_posterior(const Problem& problem, Estimate& e) {
  const ModelLevel own[] = {{}};
  linearise(problem, e.u, e.use, e.posterior.linear);
  set_covariance(mean_over_levels(problem, e.u, e.posterior.linear, own).covariance_u, e.posterior);
}

/// A subset of many touches, spread over the targets, that suffices to approach the solution.
std::vector<bool> subsample(const Problem& problem, const std::vector<bool>& use) {
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

double finest_sigma_m(const Problem& problem, const std::vector<bool>& use) {
  double finest = kFirstFloorM;
  for (std::size_t i = 0; i < use.size(); ++i)
    if (use[i]) finest = std::min(finest, problem.sigma_m(i));
  return finest;
}

[[noreturn]] void fail_to_converge(int rounds) {
  throw IdentifyError(
      IdentifyError::Kind::kNotSolved,
      fmt::format(
          "the estimate did not converge in {} iterations. Check that robot file and touches are of one arm",
          rounds));
}

/// Approaches the solution from zero errors with a sigma floor of the touches that decreases from 1
/// mm: with full weights at once, the error of the linearisation (parts per thousand of the errors)
/// would dominate the directions that the touches hardly determine. Robust against gross outliers,
/// which are excluded before any fit without robust loss.
///
/// One step per stage suffices for an arm within its tolerances; if the steps diverge, each stage
/// is solved to convergence, from zero. Returns true if the estimate is close enough for refine().
bool approach(const Problem& problem, const IdentifyOptions& options, Estimate& e) {
  constexpr double kStep = 10.0;
  constexpr double kWithinReason = 10.0;  // prior sigmas
  const std::vector<bool> all = e.use;
  e.use = subsample(problem, all);
  const double cauchy = options.reject_outliers ? kCauchySigma : 0.0;
  const double finest = finest_sigma_m(problem, e.use);
  for (double floor = kFirstFloorM; floor > finest; floor /= kStep)
    e.u =
        step_towards(problem, e.u, {.use = e.use, .cauchy_sigma = cauchy, .sigma_floor_m = floor});
  if (!e.u.allFinite() || e.u.lpNorm<Eigen::Infinity>() > kWithinReason) {
    e.u.setZero();
    for (double floor = kFirstFloorM; floor > finest; floor /= kStep)
      e.u = solve(problem, e.u, {.use = e.use, .cauchy_sigma = cauchy, .sigma_floor_m = floor}).u;
  }
  if (!options.reject_outliers) {
    e.use = all;
    return false;
  }
  const SolveOptions robust{.use = e.use, .cauchy_sigma = cauchy, .sigma_floor_m = finest};
  const SolveResult solved = solve(problem, e.u, robust);
  e.u = solved.u;
  find_posterior(problem, e);
  e.use = select_inliers(problem, e);
  return solved.converged && !needs_all_digits(problem, robust);
}

/// Repeats the approach in smaller steps of the floor, each solved to convergence, where the last
/// stage was too long for the solver. Test OccurrenceLimit needs it: noise-free touches with little
/// information on some unknown.
void approach_slowly(const Problem& problem, Estimate& e) {
  constexpr double kStep = 3.0;
  const double finest = finest_sigma_m(problem, e.use);
  e.u.setZero();
  for (double floor = kFirstFloorM; floor > finest; floor /= kStep)
    e.u = solve(problem, e.u, {.use = e.use, .sigma_floor_m = floor}).u;
}

/// Alternates solving and outlier rejection until the set of touches in use no longer changes;
/// excluded touches may be readmitted. On return e.posterior.linear is at e.u.
void settle(const Problem& problem, const IdentifyOptions& options, Estimate& e) {
  OutlierRejection rejection(problem, options);
  for (int round = 0; round < kOutlierRounds; ++round) {
    SolveOptions plain{e.use};
    // Noise-free touches are solved to convergence; for others the step over the levels follows.
    if (!needs_all_digits(problem, plain)) plain.tolerance = 1e-5;
    SolveResult solved = solve(problem, e.u, plain);
    if (!solved.converged) {
      approach_slowly(problem, e);
      solved = solve(problem, e.u, plain);
    }
    if (!solved.converged) fail_to_converge(plain.max_iterations);
    e.u = solved.u;
    if (!options.reject_outliers) {
      linearise(problem, e.u, e.use, e.posterior.linear);
      return;
    }
    find_posterior(problem, e);
    if (!rejection.changed(problem, e, true)) return;
  }
  linearise(problem, e.u, e.use, e.posterior.linear);
}

}  // namespace

std::vector<bool> fit_touches(const Problem& problem) {
  std::vector<bool> fit(problem.touches().size());
  for (std::size_t i = 0; i < fit.size(); ++i) fit[i] = problem.touches()[i].set == TouchSet::kFit;
  return fit;
}

std::vector<bool> select_inliers(const Problem& problem, Estimate& e) {
  std::vector<bool> inliers = fit_touches(problem);
  const std::vector<Studentised> off = studentise_and_set_gate(problem, inliers, e);
  for (std::size_t i = 0; i < off.size(); ++i)
    if (off[i].sigmas > e.gate) inliers[i] = false;
  return inliers;
}

/// Each round is one Gauss-Newton step of every level, or a share of it (Relaxation); levels of
/// negligible probability are dropped.
void refine(Problem& problem, const IdentifyOptions& options, std::vector<ModelLevel> levels,
            Estimate& e) {
  // In prior sigmas. A step of this size leaves an error of a thousandth of it: the unknowns are
  // milliradians, by which factor the next term of the expansion is smaller.
  constexpr double kStep = 1e-2;
  constexpr double kDivergedStep = 1.0;  // a last step of this size means no estimate
  // Larger steps permit no permanent decisions on outliers, except in the second half of the
  // rounds.
  constexpr double kNear = 5.0;
  constexpr double kNegligibleProbability = 1e-4;
  const std::vector<ModelLevel> every = levels;
  LevelMean first;
  OutlierRejection rejection(problem, options);
  Relaxation relaxation;
  for (int round = 0;; ++round) {
    LevelMean mean = mean_over_levels(problem, e.u, e.posterior.linear, levels);
    const Eigen::VectorXd off = mean.u - e.u;
    const double step = off.lpNorm<Eigen::Infinity>();
    const double share = relaxation.share_of(off);
    e.u = share < 1.0 ? Eigen::VectorXd(e.u + share * off) : mean.u;
    problem.set_ripple(mean.ripple_rad);
    linearise(problem, e.u, e.use, e.posterior.linear);
    set_covariance(mean.covariance_u, e.posterior);
    const bool last = round == kOutlierRounds;
    if (last && !(step < kDivergedStep)) fail_to_converge(kOutlierRounds);
    const bool changed =
        !last && rejection.changed(problem, e, step < kNear || round > kOutlierRounds / 2);
    if ((!changed && step < kStep) || last) {
      std::vector<LevelEvidence> shown = std::move(mean.levels);
      for (const LevelEvidence& l : first.levels)
        if (std::none_of(shown.begin(), shown.end(),
                         [&](const LevelEvidence& other) { return other.level == l.level; }))
          shown.push_back(l);
      double all = 0.0;
      for (const LevelEvidence& l : shown) all += l.probability;
      for (LevelEvidence& l : shown) l.probability /= all;
      mean.levels = std::move(shown);
      e.levels = std::move(mean);
      return;
    }
    if (changed) {  // an outlier more or less changes the levels' probabilities
      relaxation.forget();
      linearise(problem, e.u, e.use, e.posterior.linear);
      if (!first.levels.empty()) levels = every;
      first = {};
    } else if (first.levels.empty() && step < kDivergedStep) {
      levels.clear();
      for (const LevelEvidence& l : mean.levels)
        if (l.probability > kNegligibleProbability) levels.push_back(l.level);
      first = std::move(mean);
    }
  }
}

Estimate estimate(Problem& problem, const IdentifyOptions& options,
                  std::vector<ModelLevel> levels) {
  Estimate e;
  e.use = fit_touches(problem);
  e.u = Eigen::VectorXd::Zero(problem.size());
  const bool there = approach(problem, options, e);
  if (!there) settle(problem, options, e);
  // A subset of many touches already shows which levels are negligible.
  std::vector<bool> some = subsample(problem, e.use);
  const bool share = some != e.use;
  if (share) {
    constexpr double kNegligibleProbability = 1e-9;
    std::vector<bool> all = std::move(e.use);
    e.use = std::move(some);
    IdentifyOptions these = options;
    these.reject_outliers = false;  // outliers are selected already
    linearise(problem, e.u, e.use, e.posterior.linear);
    refine(problem, these, levels, e);
    std::erase_if(levels, [&](const ModelLevel& level) {
      return std::any_of(e.levels.levels.begin(), e.levels.levels.end(),
                         [&](const LevelEvidence& l) {
                           return l.level == level && l.probability < kNegligibleProbability;
                         });
    });
    e.use = std::move(all);
  }
  if (there || share) linearise(problem, e.u, e.use, e.posterior.linear);
  refine(problem, options, std::move(levels), e);
  return e;
}

}  // namespace cellcal::calib
