#pragma once
// What an estimate still leaves unknown, and what each candidate would take from it.

#include "calib/estimate/incremental_estimate.h"
#include "calib/plan/choice/design.h"
#include "calib/plan/reach/pool.h"

namespace cellcal::calib {

struct RemainingUncertainty {
  Design design;          ///< candidates as the estimate sees them; none of them taken
  Eigen::MatrixXd moves;  ///< of the region, at the estimate (region.h)
  double mean_m;          ///< mean error over the region that is foreseen
  double u95_m;           ///< mean over it of the radius that holds the error at 95 %
};

/// Of `pool`, for the region of `options`.
RemainingUncertainty remaining_uncertainty(const Cell& cell, const Pool& pool,
                                           const PlanOptions& options,
                                           const IncrementalEstimate& estimate);

}  // namespace cellcal::calib
