#pragma once
// Touches of an adaptive session: each is chosen by the results of those before. First spheres with
// unknown places are located (finder.h), then all are touched until the goal is reached (online.h, with a
// positioner GoalBatches). The positioner stays where it is until all spheres are found.

#include <optional>
#include <string>
#include <vector>

#include "calib/model/hidden.h"
#include "calib/model/joint_vector.h"
#include "calib/plan/finder.h"
#include "calib/plan/online.h"
#include "calib/words/phrase.h"

namespace cellcal::calib {

// Touches to a goal in a cell with a positioner: planned in batches, so that its axes turn rarely.
//
// The first batch has as many touches as the goal is predicted to take (92), and the check touches, which after
// touches made before are in the first batch that follows. After each
// batch all touches are identified; where u95 over the region misses the goal, the next one has those that are
// foreseen to be missing, chosen without regard to the touches before, with other draws.

class GoalBatches {
 public:
  /// `made`: earlier touches of a resumed session. Throws as make_plan().
  GoalBatches(const Cell& cell, const PlanOptions& options, const Goal& goal,
              const std::vector<Touch>& made);

  /// The next touch with its path from the arm's and the positioner's present angles; empty once done. Repeated
  /// until touched() or failed() is called. Throws PlanError if no clear path leads away.
  /// `in_contact`: as resume_plan().
  std::optional<PlannedTouch> next(const JointVector& from, bool in_contact,
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
  Hidden<Impl> impl_;
};

// A search and its retreat, in a form that outlives the session.
//
// Which postures near a sphere are clear depends on the contacts and misses of the session. If a
// session is aborted, or its process killed, the arm stays there, and the next session has the cell
// file only, by which the arm is inside the possible region of the sphere. It retreats by the moves
// recorded here, which were checked before the search.

/// Angles of all axes, those of a positioner last: where it has been turned since, the moves do not lead out.
struct SearchUnderWay {
  std::string target;            ///< empty: no search, the arm returns
  std::vector<JointVector> way;  ///< from the starting position, via way-points, to the stand-off
  JointVector end;               ///< of the search; empty: none
  /// From the clear point, the first, to a posture from which any session can start. Empty: no path is
  /// known.
  std::vector<JointVector> out;

  bool operator==(const SearchUnderWay&) const = default;
};

/// Tolerance of each joint for an arm at rest on a move [rad]: 3.5 mm at 1 m, against 11 mm of clearance
/// of the tip.
inline constexpr double kOnWayRad = 0.0035;

/// Way-points from `at` on, by the recorded moves only; empty if the arm is not on them, or they have no
/// retreat. `in_contact`: only out of the search, since on the way to it they lead forwards.
std::optional<std::vector<JointVector>> way_out_of(const SearchUnderWay& left,
                                                   const JointVector& at, bool in_contact);

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

  /// The next touch with its path from the current position; empty once done. Repeated until
  /// touched() or failed() is called. `in_contact`: the tip touches a sphere; the first waypoint
  /// then leads straight away from it. `positioner_rad`: present angles of its axes. Throws PlanError
  /// if no clear path leads out; the operator has to jog the arm.
  std::optional<PlannedTouch> next(const JointVector& from, bool in_contact,
                                   const std::vector<double>& positioner_rad = {});
  /// Throws IdentifyError if all touches together determine no estimate.
  void touched(const Touch& touch);
  void failed(NotMade how);
  /// From the clear point of the last touch.
  std::vector<JointVector> way_home(const JointVector& from) const;
  /// The touch offered by next() and its retreat; the return path if there is none. Empty once all
  /// spheres are found.
  std::optional<SearchUnderWay> under_way(const JointVector& from,
                                          const std::optional<PlannedTouch>& touch) const;

  const Progress& progress() const;
  /// As Finder::located().
  Cell located() const;
  /// Current activity: a target being found and how far it is known, touching, or checking.
  Phrase stage() const;

 private:
  struct Impl;
  Hidden<Impl> impl_;
};

}  // namespace cellcal::calib
