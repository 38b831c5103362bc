#pragma once
// The seed paper's estimator as published, for comparison only: Wang et al., Appl. Sci. 2024, 14,
// 9824, Eqs. 7-38. It is the baseline that cellcal is compared with.
//
// Model (Eqs. 7-27): the errors X of the joints and of the tool's bending move the nominal tip
// linearly, p = p_N + A X. A, the paper's product of transmission matrices G_i and K_i at nominal
// geometry, is the derivative of the tip there. Second-order terms are dropped; they are about
// 0.01 mm for errors of 1 mm and 1 mrad.
//
// Residual (Eq. 33): |A X + p_N - c|^2 - R^2, squared distances in m^2.
//
// Solution (Eq. 38): X += -(J^T J + lambda I)^-1 J^T f with constant lambda, from zero errors and
// the linear sphere fit of the nominal positions.
//
// Assumption: one sphere, its radius known, no outliers, no priors. Failure case: its 28 unknowns
// have rank 25 on one sphere; the values in the three frame directions, and along the nearly
// undetermined scale, depend on lambda and are arbitrary. Touches on the same sphere cannot reveal
// it.

#include <vector>

#include "calib/model/error.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

struct PaperOptions {
  /// Eq. 38's "positive adjustable coefficient", for metres and radians. The paper gives no value;
  /// this one is best on unseen touches of both its tasks (sim/paper prints the others).
  double lambda = 1e-4;
  int iterations = 50;            ///< the paper's Figure 6 ends at 50
  double step_tolerance = 1e-13;  ///< on the norm of the step
};

/// Progress per iteration; entry 0 is the start.
struct PaperTrace {
  struct Iteration {
    double mean_m = 0.0, max_m = 0.0;  ///< Eq. 39 over the fit touches
    double step = 0.0;                 ///< norm of the preceding step (m, rad, 1/(N m^2))
  };
  std::vector<Iteration> iterations;
};

/// Throws IdentifyError unless the touches lie on a single sphere and are at least four. Estimates
/// the geometric errors and c_t of the cell's robot file and the sphere's centre; everything else
/// stays nominal. Residuals are Eq. 39 under the paper's own linear model. The verdict always
/// withholds the result; its covariance is the priors'.
Calibration identify_paper(const Cell& cell, const std::vector<Touch>& touches,
                           const PaperOptions& options = {}, PaperTrace* trace = nullptr);

}  // namespace cellcal::calib
