#pragma once
// Choice of touches among candidates.

#include <cstddef>
#include <functional>
#include <vector>

#include "calib/plan/accuracy_region.h"
#include "calib/plan/candidates.h"
#include "calib/plan/design.h"
#include "calib/plan/missing.h"
#include "calib/plan/pool.h"

namespace cellcal::calib {

struct ChooseOptions {
  int count = 40;
  int least_per_target = 5;  ///< minimum number of touches per sphere
  Criterion criterion = Criterion::kI;
  AccuracyRegion region;           ///< region of interest
  int exchanges = 2;               ///< maximum rounds of exchange
  unsigned seed = 1;               ///< of a random choice
  std::vector<std::size_t> start;  ///< initial picks, feasible; may be exchanged
  /// Called at most once for a candidate before it is picked; false: infeasible. Null: all are
  /// feasible.
  std::function<bool(std::size_t)> possible;
};

struct Choice {
  std::vector<std::size_t> picked;  ///< indices of candidates
  double predicted_mean_m = 0.0;    ///< mean 3-D error over the region after these touches
  double reducible_m = 0.0;         ///< part of it that further touches could remove
  /// Mean over the region of the 95 % radius (calib/estimate/predict.h); 0 for the tool's region.
  double predicted_u95_m = 0.0;
  Missing largest = {};  ///< part of what further touches could remove
};

/// Fewer than `count` if no more are feasible.
Choice choose(const Cell& cell, const std::vector<Candidate>& candidates,
              const ChooseOptions& options);

struct Picked {
  std::size_t candidate = 0;
  TouchSet set = TouchSet::kFit;
};
/// The picks, followed by check touches drawn at random from the first `spread` candidates, so that
/// they represent postures not used by the fit. `targets`: number of planned ones. Throws PlanError
/// if too few are left.
std::vector<Picked> with_check_touches(const Cell& cell, const std::vector<Candidate>& candidates,
                                       const std::vector<std::size_t>& picked, std::size_t spread,
                                       int targets, const PlanOptions& options,
                                       const std::function<bool(std::size_t)>& possible);

// A plan to a goal: as many touches as it is predicted to take (92).

/// Calls `choose_of` with growing numbers until the `choice` that it fills reaches options.goal_u95_m, or the most
/// touches allowed; without a goal once. `targets`: number of planned ones.
void choose_to_goal(const PlanOptions& options, int targets,
                    const std::function<void(int count)>& choose_of, const Choice& choice);
/// Fills the predicted figures of the plan, with a goal for the end of a session, and what keeps it from the goal.
void foresee(const Choice& choice, const PlanOptions& options, Plan& plan);

// Joint choice of the touches that reduce the uncertainty of an estimate most.

/// `count` candidates of the design, picked greedily by (67) and then exchanged; fewer if no more
/// are feasible. `possible`: called for a candidate only before it is picked, and not again after
/// returning false.
std::vector<std::size_t> choose_together(Design design, int count,
                                         const std::function<bool(std::size_t)>& possible);

// Refinement of a choice by variations of its picks.

/// Progress of a plan, as shares of its time, after reach, choice and refinement; the rest is for paths.
inline constexpr double kReachShare = 0.05, kChosenShare = 0.15, kRefinedShare = 0.6;

/// Exchanges the picks for variations by decreasing angles, as long as the gain is sufficient.
/// `choice`: among the pool's candidates, by `how`. Removes candidates from `spread` on, except the
/// picks.
void add_neighbours(const Cell& cell, Pool& pool, std::size_t spread, ChooseOptions how,
                    Choice& choice);

}  // namespace cellcal::calib
