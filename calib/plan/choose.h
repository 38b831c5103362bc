#pragma once
// Which candidates to touch.

#include <cstddef>
#include <functional>
#include <vector>

#include "calib/plan/accuracy_region.h"
#include "calib/plan/candidates.h"
#include "calib/plan/design.h"
#include "calib/plan/pool.h"

namespace cellcal::calib {

struct ChooseOptions {
  int count = 40;
  int least_per_target = 5;  ///< every sphere gets at least this many
  Criterion criterion = Criterion::kI;
  AccuracyRegion region;  ///< where accuracy matters
  int exchanges = 2;      ///< rounds at most in which each touch may be exchanged for a better one
  unsigned seed = 1;      ///< of a random choice
  std::vector<std::size_t> start;  ///< picked already, possible; may be exchanged
  /// Asked of a candidate before it is picked, at most once: whether it can be made. Null: all can.
  std::function<bool(std::size_t)> possible;
};

struct Choice {
  std::vector<std::size_t> picked;  ///< indices into the candidates
  double predicted_mean_m = 0.0;    ///< mean 3-D error over the region after these touches
  double reducible_m = 0.0;         ///< of it, what further touches could take away
  /// Mean over the region of the radius that holds it at 95 % (bound.h); 0 of the tool's region.
  double predicted_u95_m = 0.0;
};

/// Fewer than `count` where no more are possible.
Choice choose(const Cell& cell, const std::vector<Candidate>& candidates,
              const ChooseOptions& options);

// Which touches together take most from what an estimate leaves unknown.

/// `count` candidates of the design, one after the other by (67) and then exchanged for better ones;
/// fewer where no more are possible. `possible`: asked of a candidate only before it is picked, and
/// not again where it said no.
std::vector<std::size_t> choose_together(Design design, int count,
                                         const std::function<bool(std::size_t)>& possible);

// A choice made better by candidates beside those that it picked.

/// Of the time that a plan takes, so much is gone when it is known what the arm reaches, when touches are chosen,
/// and when they are exchanged for better ones; the ways are the rest.
inline constexpr double kReachShare = 0.05, kChosenShare = 0.15, kRefinedShare = 0.6;

/// Exchanges the picked for others like them, turned by ever smaller angles, as long as that brings
/// enough. `choice`: of the pool's candidates, by `how`. Those from `spread` on are forgotten, but
/// the picked.
void look_around(const Cell& cell, Pool& pool, std::size_t spread, ChooseOptions how,
                 Choice& choice);

}  // namespace cellcal::calib
