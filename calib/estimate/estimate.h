#pragma once
// Estimate of all unknowns: from zero errors, coarse to exact, first robust, then with outliers
// removed, and finally the mean over the model levels.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "calib/estimate/evidence.h"
#include "calib/estimate/options.h"
#include "calib/estimate/problem.h"
#include "calib/estimate/solve.h"

namespace cellcal::calib {

/// Linearisation and uncertainty at an estimate.
struct Posterior {
  Linearisation linear;
  Eigen::MatrixXd covariance_u;  ///< in prior units
  Eigen::VectorXd leverage;      ///< per row of the linearisation: j S j'
  /// With correlated touch errors (discrepancy.h): L with L L' = their correlation; the rows of the
  /// linearisation are multiplied by L^-1. Empty for independent errors.
  Eigen::MatrixXd together;
};

struct Estimate {
  Eigen::VectorXd u;
  std::vector<bool> use;  ///< per touch: fit touches that are not outliers
  Posterior posterior;
  LevelMean levels;
  double gate = 0.0;  ///< studentised residual beyond which a touch is an outlier
};

/// Mean over `levels`. `problem` is at the fullest level and without ripple on entry, and has the
/// ripple of the mean on return. Throws IdentifyError if touches and priors determine nothing.
Estimate estimate(Problem& problem, const IdentifyOptions& options, std::vector<ModelLevel> levels);

/// Last stage of estimate(), from an estimate near the solution: steps of all levels and outlier
/// rejection in turn until neither changes. `e.posterior.linear` is at e.u.
void refine(Problem& problem, const IdentifyOptions& options, std::vector<ModelLevel> levels,
            Estimate& e);

// Outliers: fit touches with a studentised residual beyond the gate. They are excluded from the
// estimate, tested again at each step, and may be readmitted.

/// True for each fit touch; one entry per touch.
std::vector<bool> fit_touches(const Problem& problem);

/// Studentised residual of a touch: |r| / sigma, with its own influence on the fit removed for used
/// touches and the uncertainty of the fit added for the others.
struct Studentised {
  double sigmas = 0.0;
  /// Leverage of an excluded touch if readmitted, j S j' / (1 + j S j'). Near 1 no other
  /// touch determines its direction, and a small residual is no evidence in its favour.
  double own = 0.0;
};

/// Fit touches within the gate at the estimate, currently excluded ones included. Sets e.gate.
std::vector<bool> select_inliers(const Problem& problem, const IdentifyOptions& options,
                                 Estimate& e);

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
  OutlierRejection(const Problem& problem, const IdentifyOptions& options);

  /// Updates e.use and returns true if it changed. `near`: the estimate is close enough to the
  /// solution for permanent decisions.
  bool changed(const Problem& problem, Estimate& e, bool near);

 private:
  /// Per target block, the excluded touch of least residual among those that no other touch
  /// determines; the number of touches if there is none.
  std::vector<std::size_t> first_undetermined(const Problem& problem, const Estimate& e,
                                              const std::vector<Studentised>& off,
                                              double own) const;

  const IdentifyOptions& options_;
  std::vector<bool> fit_, came_back_, settled_;
};

// Play that the load closes: tested after the estimate without it.

/// Estimates `played`, an arm with play, starting from the estimate `e` of `plain`, the same arm
/// without. Returns true and replaces `e` if the touches raise the odds of play above its prior
/// odds; otherwise leaves `e` unchanged. weigh_repeats() has been applied to both problems.
bool estimate_with_play(const Problem& plain, Problem& played, const IdentifyOptions& options,
                        Estimate& e);

}  // namespace cellcal::calib
