#pragma once
// What an estimate still leaves unknown, and what each candidate would take from it.

#include <utility>
#include <vector>

#include "calib/estimate/incremental_estimate.h"
#include "calib/plan/design.h"
#include "calib/plan/pool.h"

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

// How many more touches a goal takes, by how the last ones brought the bound down.

/// The model's own foresight holds all its levels to be as likely as now. Touches tell them apart,
/// and the bound then falls faster: as a power of their number, fitted to the last sixteen.
/// `bounds`: u95 [m] after so many touches. At least 1; `most` where there is nothing to go by.
int touches_by_trend(const std::vector<std::pair<int, double>>& bounds, double goal_m, int most);

}  // namespace cellcal::calib
