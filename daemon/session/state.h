#pragma once
// Complete state of a session. A value: step() maps one to the next.

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "calib/plan/touch_sequence.h"
#include "daemon/session/action.h"
#include "daemon/session/event.h"
#include "daemon/session/failure.h"
#include "daemon/session/interruption.h"
#include "daemon/session/phase.h"
#include "daemon/session/touch_policy.h"

namespace cellcal::daemon {

/// Answer of the worker to a request made ahead; kept until the arm reaches the clear point.
struct PrefetchedAnswer {
  bool asked = false;
  std::shared_ptr<const Event> answer;
};

/// With touches chosen one by one: first target of a session interrupted on a search line. The path of
/// arrival is clear, whatever is known of the sphere; another path may not be.
enum class ResumePath {
  kNone,      ///< a path is planned from the current position
  kToSearch,  ///< to the start of the search, then the same touch again
  kToClear,   ///< the touch is made or given up: on to the clear point
};

/// A decided move. It begins when everything recorded before it is on disk.
struct HeldMove {
  drivers::Move move;
  std::chrono::milliseconds timeout{0};  ///< limit for the move itself
};

struct State {
  Phase phase = Phase::kIdle;

  // Fixed when the session starts.
  TouchPolicy policy;
  std::string load;  ///< held in all touches
  Timeouts timeouts;
  bool dry = false;         ///< from stand-off to stand-off, without searches and records
  bool one_by_one = false;  ///< touches are chosen during the session, not planned beforehand
  /// Continues with the touches of a journal, or by itself from a position where a contact may be closed:
  /// only then may the first move lead out of a contact.
  bool resumed = false;
  /// Search left by the previous session. Where the arm is still in it, the first move may lead out of a
  /// contact, too.
  std::shared_ptr<const calib::SearchUnderWay> left;
  bool unattended = false;     ///< begins only while no person works at the robot
  int retries = 0;             ///< automatic continuations after harmless interruptions
  BusyRepeats repeats{0, 0};   ///< likewise after lateness of this computer
  calib::Phrase how_to_start;  ///< what the operator starts on the pendant; for messages
  std::size_t done = 0;        ///< touches on disk; also the index of the next one
  std::string expected_hash;   ///< resumed: hash of the stored plan; empty: not compared
  /// Command of a new session of a kind that is not resumed; empty: it is resumed.
  std::string anew;

  /// Null before planning. With touches chosen one by one it holds the current touch, or none and the way
  /// home.
  std::shared_ptr<const calib::Plan> plan;
  std::string plan_hash;
  bool routed_in_contact = false;    ///< contact state when the path was requested
  Links links;                       ///< newest values
  std::optional<double> residual_m;  ///< of the newest touch, once assessed
  std::size_t assessed = 0;  ///< number of touches at which residual_m is that of the newest

  // Touches chosen one by one.
  calib::Progress progress;
  std::size_t chosen_after = 0;  ///< touches on disk when `plan` and `progress` were chosen
  calib::Phrase stage;  ///< purpose of the current touch
  /// The current touch could not be made; another replaces it.
  std::optional<calib::NotMade> touch_failed;
  int failed_in_a_row = 0, failed_touches = 0;
  PrefetchedAnswer ahead;  ///< choice of the next touch, while the arm leaves the last one

  std::vector<std::string> met;  ///< targets touched so far
  /// With planned touches: expected contact of each, from the touches so far; null: not known yet.
  std::shared_ptr<const std::vector<calib::ExpectedContact>> expected;

  // The current touch.
  /// End of the newest move: waypoint of the transit, or of the way home.
  std::size_t waypoint = 0;
  bool leads_on = false;         ///< the retreat from the last touch continues to this one
  double approach_m = 0.0;       ///< travel at which its first search begins
  double search_from_m = 0.0;    ///< travel at which the next search begins
  std::optional<Reading> first;  ///< contact of the fast search
  std::vector<Reading> slow;
  int revoked = 0;
  bool missed = false;       ///< end of travel without contact; the sensor is tested first
  bool arm_pending = false;  ///< arming requested, not answered yet
  bool self_tested = false;  ///< the sensor was commanded to repeat its self-test for this arming

  std::uint32_t move_id = 0;     ///< of the newest move; results of others are stale
  std::optional<HeldMove> held;  ///< the newest move, until it has begun
  std::uint16_t arm_id = 0;      ///< of the newest arming
  std::uint32_t route_id = 0;    ///< of the newest request for a path or a touch
  std::uint64_t total_revoked = 0;

  // Harmless interruptions (interruption.h).
  InterruptionCounts interruptions;  ///< those after which the session continued or tries to
  /// The newest: the failure of the session if it cannot continue.
  std::optional<Failure> interrupted;
  drivers::AxisAngles left_rad;            ///< position at which the arm came to rest
  std::uint32_t left_session = 0;          ///< session of the controller in which it happened
  std::uint64_t replies_before = 0;        ///< late replies at the begin of watching
  std::uint32_t interruptions_before = 0;  ///< of the robot's link, likewise
  ResumePath resume_path = ResumePath::kNone;
  bool pause_noted = false;    ///< raised while a touch was being written to disk
  int busy_of_touch = 0;       ///< repeats of busy_touch caused by lateness of this computer
  std::size_t busy_touch = 0;  ///< the touch that busy_of_touch counts for
  /// The sensor was silent for an unknown cause. Counted once the cause is known.
  bool unheard = false;
  std::uint32_t late_then = 0, silent_then = 0;  ///< ContactDelivery at the interruption
  std::uint32_t late_before = 0;  ///< ContactDelivery::late at the begin of watching or arming
  /// End of the wait for a busy spell of this computer.
  std::optional<drivers::TimePoint> busy_until;

  std::optional<drivers::TimePoint> deadline;  ///< of this phase
  std::optional<FailureKind> aborted_for;      ///< by the daemon itself; none: by a person
  /// Set in kStopping and kFailed, and in kAborted by the daemon itself.
  std::optional<Failure> failure;
  std::optional<Failure>
      deferred_failure;  ///< not found: failure of the session once the arm is home
  std::shared_ptr<const SessionResult> result;  ///< once identified

  /// Index of the current touch in the plan.
  std::size_t current_index() const { return one_by_one ? 0 : done; }
  const calib::PlannedTouch& planned() const { return plan->touches.at(current_index()); }
  /// The touch that the arm is at, or leaves: during its retreat it is done already. Null without one.
  const calib::PlannedTouch* at_hand() const {
    const std::size_t left = phase == Phase::kRetreat && !one_by_one && done > 0 ? 1 : 0;
    const std::size_t index = current_index() - left;
    return plan && index < plan->touches.size() ? &plan->touches[index] : nullptr;
  }
  /// Touches of the whole session, as far as foreseeable.
  std::size_t total() const {
    if (one_by_one)
      return chosen_after + static_cast<std::size_t>(std::max(0, progress.touches_left)) +
             static_cast<std::size_t>(std::max(0, progress.checks_left));
    return plan ? plan->touches.size() : 0;
  }
};

}  // namespace cellcal::daemon
