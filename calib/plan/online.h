#pragma once
// Touches to a goal: offered one by one, until the accuracy asked for is reached or further touches
// no longer pay.
//
// As many as the goal is foreseen to take are planned together before the first, on nominal
// geometry; kFirstTouches of each sphere and plane come first, for an estimate. From then on the
// search lines are made with the arm as it is known by then, so that they can be short. What is
// missing behind the plan is chosen together by what the touches so far have left unknown. A touch
// that failed is not offered again. Behind the last come the check touches, drawn at random: they
// stand for all that the fit has not seen.

#include <memory>
#include <optional>
#include <string>

#include "calib/model/touch.h"
#include "calib/plan/duration.h"
#include "calib/plan/plan.h"

namespace cellcal::calib {

/// Of each sphere and plane, before there is an estimate to go by.
inline constexpr int kFirstTouches = 5;

/// Of what a plan leaves that further touches could take away, u95 comes to about so much once the
/// touches are made and have told which of the model's errors the arm has (tests/experiments/online).
inline constexpr double kBoundOverError = 2.1;

struct Goal {
  double u95_m = 0.15e-3;  ///< mean over the region of the radius that holds the position error
  int most_touches = 200;  ///< fit touches, whatever is reached
  double worth_it = 0.02;  ///< ten more touches have to take this share off the predicted error
};

/// Why no further fit touch is offered.
enum class Ended {
  kGoal,          ///< it is reached
  kMostTouches,   ///< as many as are allowed are made
  kNoGain,        ///< ten more would not be worth it
  kNoEstimate,    ///< a target cannot be touched often enough for a first estimate
  kAllReachable,  ///< none is left that the arm reaches
};

struct Progress {
  int touches = 0;      ///< fit touches that were made
  double u95_m = 0.0;   ///< mean over the region, predicted; 0: not known yet
  double mean_m = 0.0;  ///< mean 3-D error over the region, predicted
  /// To the goal, as far as can be predicted, from the beginning; of a goal out of reach, to the end.
  int touches_left = 0;
  int checks_left = 0;           ///< check touches still to be made
  bool finding = false;          ///< places of spheres are still being found
  bool fitted = false;           ///< the last fit touch was made
  std::optional<Ended> ended{};  ///< why it was the last one; none of touches planned beforehand
  bool done = false;             ///< the check touches are made, too
};

/// Why no further touch was chosen on the way to the goal; empty where one may be.
std::string why_ended(const Progress& progress, const Goal& goal);

class Online {
 public:
  /// `start`: where the arm is, and where way_home() leads; empty: the resting posture. `made`:
  /// touches that were made before, by a session that goes on. Of the options, `check_touches` says
  /// how many checks there are; `fit_touches` says nothing. Throws PlanError as make_plan() does,
  /// IdentifyError as touched() does.
  Online(const Cell& cell, const PlanOptions& options, const Goal& goal, const JointVector& start,
         const Pace& pace = {}, const std::vector<Touch>& made = {});
  ~Online();
  Online(Online&&) noexcept;
  Online& operator=(Online&&) noexcept;

  /// The next touch with its way from `from` (empty: the start); empty once done. Offered again
  /// until touched() or failed() is called. Throws PlanError where no clear way leads away from
  /// `from`.
  std::optional<PlannedTouch> next(const JointVector& from);
  /// The touch that next() offered, as it was measured. Throws IdentifyError where all touches
  /// together determine nothing.
  void touched(const Touch& touch);
  /// It could not be made: not reached, contact where nothing is, readings that disagree.
  void failed();
  /// From the clear point of the last touch offered; empty: none is clear, the arm stays there.
  std::vector<JointVector> way_home() const;

  const Progress& progress() const;
  /// Fit touches.
  const std::vector<Touch>& touches() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::calib
