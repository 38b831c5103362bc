#pragma once
// Offers touches one by one until the required accuracy is reached or further touches are not worth
// their time.
//
// The touches predicted for the goal are planned together before the first, on nominal geometry;
// kFirstTouches of each sphere and plane come first, for an estimate. From then on search lines are
// planned with the current estimate and are shorter. Touches beyond the plan are chosen together by
// the remaining uncertainty. A failed touch is not offered again. The last ones are check touches,
// drawn at random, so that they represent postures not used by the fit.

#include <optional>
#include <string>

#include "calib/model/hidden.h"
#include "calib/model/touch.h"
#include "calib/plan/plan.h"

namespace cellcal::calib {

/// Touches of each sphere and plane before the first estimate.
inline constexpr int kFirstTouches = 5;

/// Ratio of u95, after the touches have determined the model errors of the arm, to the reducible
/// error of a plan (tests/experiments/run online).
inline constexpr double kBoundOverError = 2.1;

/// (92): touches to a goal, foreseen from a plan of `count` touches that leaves `reducible_m`.
double touches_to_goal(std::size_t count, double reducible_m, double goal_u95_m);

struct Goal {
  double u95_m = 0.15e-3;  ///< mean over the region of the 95 % radius of the position error
  int most_touches = 200;  ///< maximum number of fit touches
  double worth_it = 0.02;  ///< minimum relative error reduction by ten more touches
};

/// Reason why no further fit touch is offered.
enum class Ended {
  kGoal,          ///< reached
  kMostTouches,   ///< maximum number reached
  kNoGain,        ///< ten more touches would not be worth it
  kNoEstimate,    ///< too few touches of a target for a first estimate
  kAllReachable,  ///< no reachable candidate is left
};

struct Progress {
  int touches = 0;      ///< fit touches made
  double u95_m = 0.0;   ///< mean over the region, predicted; 0: unknown
  double mean_m = 0.0;  ///< mean 3-D error over the region, predicted
  /// Predicted number to the goal, available from the start; to the end if the goal is out of reach.
  int touches_left = 0;
  int checks_left = 0;   ///< check touches remaining
  bool finding = false;  ///< spheres are still being located
  bool fitted = false;   ///< all fit touches are made
  /// Largest contribution to u95 above the goal; set at the end if it was not reached.
  std::optional<Missing> missing{};
  std::optional<Ended> ended{};  ///< reason for the end; empty for touches planned beforehand
  bool done = false;             ///< including the check touches
};

/// Explains why no further touch is chosen before the goal; empty if one may be.
Phrase why_ended(const Progress& progress, const Goal& goal);

class Online {
 public:
  /// `made`: earlier touches of a resumed session. Of the options, `check_touches` is the number of
  /// checks; `fit_touches` is ignored. Throws PlanError as make_plan() does, IdentifyError as
  /// touched() does.
  Online(const Cell& cell, const PlanOptions& options, const Goal& goal,
         const std::vector<Touch>& made = {});

  /// The next touch with its path from `from` (empty: the resting posture); empty once done.
  /// Repeated until touched() or failed() is called. Throws PlanError if no clear path leads away
  /// from `from`.
  std::optional<PlannedTouch> next(const JointVector& from);
  /// Reports the measured touch offered by next(). Throws IdentifyError if all touches together
  /// determine no estimate.
  void touched(const Touch& touch);
  /// The touch failed: out of reach, unexpected contact, contradictory readings.
  void failed();
  /// From the clear point of the last touch offered to the resting posture; empty if no path is
  /// clear, or the arm is elsewhere: then it stays there.
  std::vector<JointVector> way_home(const JointVector& from) const;

  const Progress& progress() const;
  /// Fit touches.
  const std::vector<Touch>& touches() const;

 private:
  struct Impl;
  Hidden<Impl> impl_;
};

}  // namespace cellcal::calib
