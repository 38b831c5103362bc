#pragma once
// Estimate of all unknowns: from zero errors, coarse to exact, first robust, then with outliers
// removed, and finally the mean over the model levels.

#include <Eigen/Core>
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

/// Least gate; it widens if all touches scatter more than stated.
inline constexpr double kOutlierSigma = 4.0;

/// True for each fit touch; one entry per touch.
std::vector<bool> fit_touches(const Problem& problem);

/// Fit touches within the gate at the estimate, currently excluded ones included. Sets e.gate.
std::vector<bool> select_inliers(const Problem& problem, Estimate& e);

}  // namespace cellcal::calib
