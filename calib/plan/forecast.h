#pragma once
// Remaining uncertainty of an estimate, and the reduction by each candidate.

#include <utility>
#include <vector>

#include "calib/estimate/incremental_estimate.h"
#include "calib/plan/design.h"
#include "calib/plan/pool.h"

namespace cellcal::calib {

struct RemainingUncertainty {
  Design design;                      ///< candidates under the estimate; none taken
  Eigen::MatrixXd moves;              ///< of the region, at the estimate (region.h)
  double mean_m;                      ///< predicted mean error over the region
  double u95_m;                       ///< mean of the 95 % radius over the region
  std::vector<JointVector> postures;  ///< of the region
};

/// For the candidates of `pool` and the region of `options`.
RemainingUncertainty remaining_uncertainty(const Cell& cell, const Pool& pool,
                                           const PlanOptions& options,
                                           const IncrementalEstimate& estimate);

// Predicts the number of touches to a goal from the trend of the bound.

/// The model's own prediction keeps the current probabilities of its levels. Further touches
/// discriminate between them, so that the bound falls faster: as a power of their number, fitted to
/// the last sixteen. `bounds`: u95 [m] after so many touches. At least 1; `most` without a trend.
int touches_by_trend(const std::vector<std::pair<int, double>>& bounds, double goal_m, int most);

}  // namespace cellcal::calib
