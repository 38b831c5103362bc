#pragma once
// How the estimate is reached: from zero errors, coarse to exact, robust first, outliers named and
// left out, and then the mean over the model levels.

#include <vector>

#include "calib/estimate/evidence.h"
#include "calib/estimate/options.h"
#include "calib/problem/problem.h"
#include "calib/problem/solve.h"

namespace cellcal::calib {

/// What is known at an estimate.
struct Posterior {
  Linearisation linear;
  Eigen::MatrixXd covariance_u;  ///< in prior units
  Eigen::VectorXd leverage;      ///< per row of the linearisation: j S j', how far it holds itself
  /// Where the touches' errors go together (discrepancy.h): L with L L' their correlation, of whose
  /// inverse the linearisation's rows have been multiplied. Empty: they do not.
  Eigen::MatrixXd together;
};

struct Estimate {
  Eigen::VectorXd u;
  std::vector<bool> use;  ///< per touch: fit touches that are no outliers
  Posterior posterior;
  LevelMean levels;
  double gate = 0.0;  ///< studentised residual beyond which a touch is an outlier
};

/// Mean over `levels`. `problem` is at the fullest level and without ripple; it is left with the
/// mean's. Throws IdentifyError where touches and priors determine nothing.
Estimate estimate(Problem& problem, const IdentifyOptions& options, std::vector<ModelLevel> levels);

/// The last part of it, from an estimate that is near: steps of all levels and outliers in turn
/// until neither changes. `e.posterior.linear` is at e.u.
void refine(Problem& problem, const IdentifyOptions& options, std::vector<ModelLevel> levels,
            Estimate& e);

}  // namespace cellcal::calib
