#pragma once
// The touches of a session that chooses as it goes: where each goes follows from what those before
// it have shown. First the spheres are found whose places are not known (finder.h), then all are
// touched until the goal is reached (online.h).

#include <memory>
#include <optional>
#include <vector>

#include "calib/plan/finder.h"
#include "calib/plan/online.h"
#include "calib/plan/search_under_way.h"

namespace cellcal::calib {

struct TouchSequenceOptions {
  PlanOptions plan;
  Goal goal;
  bool find = false;  ///< all spheres are found by touching first, not only those without a centre
  bool only_find = false;  ///< nothing behind that
  /// Of the session before: where the arm stands on its moves, it leaves by them.
  std::optional<SearchUnderWay> left{};
};

/// What became of a touch that was offered and not made.
enum class NotMade {
  kMissed,  ///< no contact by the end of the search
  kFailed   ///< it says nothing: noise, readings that disagree
};

class TouchSequence {
 public:
  /// `made`: touches of the same session before it was interrupted. Throws as Online's constructor.
  TouchSequence(const Cell& cell, const TouchSequenceOptions& options,
                const std::vector<Touch>& made);
  ~TouchSequence();
  TouchSequence(TouchSequence&&) noexcept;
  TouchSequence& operator=(TouchSequence&&) noexcept;

  /// The next touch with its way from where the arm is; empty once done. Offered again until
  /// touched() or failed() is called. `in_contact`: the tip touches a sphere; the first waypoint
  /// then leads straight away from it. Throws PlanError where the arm stands so that no clear way
  /// leads out: the operator has to jog it.
  std::optional<PlannedTouch> next(const JointVector& from, bool in_contact);
  /// Throws IdentifyError where all touches together determine nothing.
  void touched(const Touch& touch);
  void failed(NotMade how);
  std::vector<JointVector> way_home() const;
  /// What next() offered from there, and the way out of it; of no touch the way home. Empty once all
  /// spheres are found.
  std::optional<SearchUnderWay> under_way(const JointVector& from,
                                          const std::optional<PlannedTouch>& touch) const;

  const Progress& progress() const;
  /// The cell with its spheres where they were found, or are believed to be.
  const Cell& located() const;
  /// What is being done: "finding S2: 1 touch, within 20 mm", "touching", "checking".
  std::string stage() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::calib
