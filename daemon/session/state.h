#pragma once
// All that a session knows. A value: step() takes one and gives the next.

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

/// The worker's answer to a question that was asked ahead; waits until the arm is at the clear point.
struct Ahead {
  bool asked = false;
  std::shared_ptr<const Event> answer;
};

/// Of touches chosen one by one: where a session that was interrupted on a search line goes first. The way it
/// came is clear, whatever is known of the sphere; another may not be known.
enum class WayBack {
  kNone,      ///< its way is looked for from where it stands
  kToSearch,  ///< to where the search began, and the same touch again
  kToClear,   ///< the touch is made, or given up: on out to the clear point
};

/// A move that was decided upon. It begins when all that was recorded before it is on disk.
struct HeldMove {
  drivers::Move move;
  std::chrono::milliseconds timeout{0};  ///< with the move itself
};

struct State {
  Phase phase = Phase::kIdle;

  // Fixed when the session starts.
  TouchPolicy policy;
  Timeouts timeouts;
  bool dry = false;         ///< from stand-off to stand-off; nothing is searched or recorded
  bool one_by_one = false;  ///< touches are chosen as the session goes, not planned beforehand
  /// Goes on with a journal's touches, or by itself from where a contact may be closed: then, and
  /// only then, its first move may lead out of one.
  bool resumed = false;
  /// As the session before has left it. Where the arm stands in it, the first move may lead out of a
  /// contact, too.
  std::shared_ptr<const calib::SearchUnderWay> left;
  bool unattended = false;    ///< nobody is there: it begins only where nobody works at the robot
  int retries = 0;            ///< harmless interruptions after which it goes on by itself
  BusyRepeats repeats{0, 0};  ///< likewise where this computer was late
  std::string how_to_start;   ///< what the operator starts on the pendant; for messages
  std::size_t done = 0;       ///< touches on disk; also the index of the next one
  std::string expected_hash;  ///< resumed: the plan's, as stored; empty: not compared

  /// Null before it was made. Of touches chosen one by one it holds the one in hand, or none and
  /// the way home.
  std::shared_ptr<const calib::Plan> plan;
  std::string plan_hash;
  bool routed_in_contact = false;    ///< when the way was asked for
  Links links;                       ///< as last seen
  std::optional<double> residual_m;  ///< of the newest touch, once assessed
  std::size_t assessed = 0;          ///< of so many touches residual_m is the newest's

  // Of touches chosen one by one.
  calib::Progress progress;
  std::string stage;  ///< what the touch in hand is for, in words
  std::optional<calib::NotMade>
      touch_failed;  ///< the touch in hand could not be made; another replaces it
  int failed_in_a_row = 0, failed_touches = 0;
  Ahead ahead;  ///< the choice of the next touch, while the arm leaves the last one

  std::vector<std::string> met;  ///< targets that were touched
  /// Of touches planned beforehand: where each is expected by those so far; null: not known yet.
  std::shared_ptr<const std::vector<calib::ExpectedContact>> expected;

  // The touch that is being made.
  std::size_t waypoint = 0;      ///< where the newest move ends: of the transit, or of the way home
  bool leads_on = false;         ///< the retreat from the last touch goes on to this one
  double approach_m = 0.0;       ///< travel along the search line where its first search begins
  double search_from_m = 0.0;    ///< travel along the search line where the next search begins
  std::optional<Reading> first;  ///< contact of the fast search
  std::vector<Reading> slow;     ///< readings, in order
  int revoked = 0;
  bool missed = false;       ///< end of travel without contact; the sensor proves itself first
  bool arm_pending = false;  ///< asked to be armed, no answer yet
  bool self_tested = false;  ///< the sensor was told to prove itself again for this arming

  std::uint32_t move_id = 0;     ///< of the newest move; results of others are stale
  std::optional<HeldMove> held;  ///< the newest move, until it has begun
  std::uint16_t arm_id = 0;      ///< of the newest arming
  std::uint32_t route_id = 0;    ///< of the newest question for a way or a touch
  std::uint64_t total_revoked = 0;

  // Harmless interruptions (interruption.h).
  InterruptionCounts interruptions;        ///< so far; those after which it went on or tries to
  std::optional<Failure> interrupted;      ///< the newest: what it ends with where it cannot go on
  drivers::AxisAngles left_rad;            ///< where the arm came to rest in it
  std::uint32_t left_session = 0;          ///< the controller's, in which it happened
  std::uint64_t replies_before = 0;        ///< late replies when the watch began
  std::uint32_t interruptions_before = 0;  ///< of the robot's link, likewise
  WayBack way_back = WayBack::kNone;
  bool pause_noted = false;                ///< while a touch was on its way to the disk
  int busy_of_touch = 0;                   ///< those of busy_touch in which this computer was late
  std::size_t busy_touch = 0;  ///< the touch that busy_of_touch counts for
  /// The sensor was silent, and it is not known yet whose silence it was. Counted once it is.
  bool unheard = false;
  std::uint32_t late_then = 0, silent_then = 0;  ///< ContactDelivery when it was interrupted
  std::uint32_t late_before = 0;  ///< ContactDelivery::late when watch or arming began
  std::optional<drivers::TimePoint>
      busy_until;  ///< this computer was late: so long it is waited for

  std::optional<drivers::TimePoint> deadline;  ///< of this phase
  std::optional<Failure> failure;              ///< set in kStopping and kFailed
  std::optional<Failure> behind_home;  ///< not found: the session ends so once the arm is home
  std::shared_ptr<const SessionResult> result;  ///< once identified

  /// Index of the touch in hand.
  std::size_t in_hand() const { return one_by_one ? 0 : done; }
  const calib::PlannedTouch& planned() const { return plan->touches.at(in_hand()); }
  /// Touches of the whole session, as far as it can be foreseen.
  std::size_t total() const {
    if (one_by_one)
      return done + static_cast<std::size_t>(std::max(0, progress.touches_left)) +
             static_cast<std::size_t>(std::max(0, progress.checks_left));
    return plan ? plan->touches.size() : 0;
  }
};

}  // namespace cellcal::daemon
