#pragma once
// Touches to a goal in a cell with a positioner: planned in batches, so that its axes turn rarely.
//
// The first batch has as many touches as the goal is predicted to take (92), and the check touches, which after
// touches made before are in the first batch that follows. After each
// batch all touches are identified; where u95 over the region misses the goal, the next one has those that are
// foreseen to be missing, chosen without regard to the touches before, with other draws.

#include <memory>
#include <optional>
#include <vector>

#include "calib/plan/online.h"

namespace cellcal::calib {

class GoalBatches {
 public:
  /// `made`: earlier touches of a resumed session. Throws as make_plan().
  GoalBatches(const Cell& cell, const PlanOptions& options, const Goal& goal,
              const std::vector<Touch>& made);
  ~GoalBatches();
  GoalBatches(GoalBatches&&) noexcept;
  GoalBatches& operator=(GoalBatches&&) noexcept;

  /// The next touch with its path from the arm's and the positioner's present angles; empty once done. Repeated
  /// until touched() or failed() is called. Throws PlanError if no clear path leads away.
  std::optional<PlannedTouch> next(const JointVector& from,
                                   const std::vector<double>& positioner_rad);
  /// Throws IdentifyError if all touches of a batch together determine no estimate, PlanError as make_plan().
  void touched(const Touch& touch);
  /// The touch is left out.
  void failed();
  /// From the clear point of the last touch; empty elsewhere.
  std::vector<JointVector> way_home(const JointVector& from) const;
  const Progress& progress() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::calib
