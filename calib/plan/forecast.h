#pragma once
// Remaining uncertainty of an estimate, and the reduction by each candidate.

#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "calib/estimate/incremental_estimate.h"
#include "calib/plan/design.h"
#include "calib/plan/planned_touch.h"
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

// Predicts the contacts of planned touches from those made so far: for starting a search near the
// surface, and for deciding whether one contact is sufficient. Certified lengths and centres are not used: with
// a wrong one the estimate would be wrong where the arm goes next, and the touches need none.

class ContactForecast {
 public:
  explicit ContactForecast(Cell cell);

  /// Includes those of `touches` not yet included, fit touches only. While they do not determine an
  /// estimate, nothing is predicted, and they are retried with the next touches.
  void learn(std::span<const Touch> touches);
  /// One entry per touch of the plan. Unknown for touches before `next`, and for a target with
  /// fewer than four touches.
  std::vector<ExpectedContact> of(const Plan& plan, std::size_t next) const;

 private:
  void take(const Touch& touch);
  void begin();
  std::ptrdiff_t made(const std::string& target) const;
  double misfit() const;

  Cell cell_;
  std::size_t learnt_ = 0;
  std::vector<Touch> fit_;
  std::optional<IncrementalEstimate> running_;
  double off_squares_ = 0.0;  ///< of touches before their inclusion, in sigmas
  int off_count_ = 0;
};

}  // namespace cellcal::calib
