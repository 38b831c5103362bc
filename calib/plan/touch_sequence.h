#pragma once
// Touches of an adaptive session: each is chosen by the results of those before. First spheres with
// unknown places are located (finder.h), then all are touched until the goal is reached (online.h).

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
  bool find = false;       ///< locates all spheres first, not only those without a centre
  bool only_find = false;  ///< ends after locating
  /// Search of the preceding session: an arm on its moves retreats by them.
  std::optional<SearchUnderWay> left{};
};

/// Outcome of a touch that was offered and not made.
enum class NotMade {
  kMissed,  ///< no contact by the end of the search
  kFailed   ///< no information: noise, contradictory readings
};

class TouchSequence {
 public:
  /// `made`: touches of the same session before its interruption. Throws as Online's constructor.
  TouchSequence(const Cell& cell, const TouchSequenceOptions& options,
                const std::vector<Touch>& made);
  ~TouchSequence();
  TouchSequence(TouchSequence&&) noexcept;
  TouchSequence& operator=(TouchSequence&&) noexcept;

  /// The next touch with its path from the current position; empty once done. Repeated until
  /// touched() or failed() is called. `in_contact`: the tip touches a sphere; the first waypoint
  /// then leads straight away from it. Throws PlanError if no clear path leads out; the operator
  /// has to jog the arm.
  std::optional<PlannedTouch> next(const JointVector& from, bool in_contact);
  /// Throws IdentifyError if all touches together determine no estimate.
  void touched(const Touch& touch);
  void failed(NotMade how);
  std::vector<JointVector> way_home() const;
  /// The touch offered by next() and its retreat; the return path if there is none. Empty once all
  /// spheres are found.
  std::optional<SearchUnderWay> under_way(const JointVector& from,
                                          const std::optional<PlannedTouch>& touch) const;

  const Progress& progress() const;
  /// The cell with its spheres at their found or estimated places.
  const Cell& located() const;
  /// Current activity: "finding S2: 1 touch, within 20 mm", "touching", "checking".
  std::string stage() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::calib
