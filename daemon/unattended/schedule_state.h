#pragma once
// Persistent state of the schedule: written to the journal before a session begins, so that a restart neither
// repeats a session nor releases a hold. Format "cellcal.schedule/1", in which "night" is a
// window's day, "looked" the time evaluated so far and "aborted" the session of a hold.

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/unattended/decision.h"

namespace cellcal::daemon {

/// A window decided finally: begun, refused or missed.
struct ClosedWindow {
  std::string entry, day;
  bool missed = false;  ///< nothing was begun: a clock set back may repeat it
};

/// Simultaneous values of the wall clock and the clock since boot.
struct ClockMark {
  std::string boot;  ///< id of this boot; empty: none
  UtcSeconds utc = 0;
  double since_boot_s = 0.0;
};

/// The wall clock is not used.
struct ClockDoubt {
  Why why = Why::kClockStepped;
  double set_by_s = 0.0;
};

/// Nothing begins until released, or until a later session is done.
struct Hold {
  std::int64_t session = 0;  ///< the newest at that time
  Why why = Why::kAbortedBefore;
};

struct ScheduleState {
  UtcSeconds evaluated_until = 0;           ///< evaluated up to this time
  std::map<std::string, UtcSeconds> known;  ///< time at which an entry was added
  std::deque<ClosedWindow> closed;          ///< newest last
  std::optional<Hold> hold;
  ClockMark clock;
  std::optional<ClockDoubt> clock_doubt;
  std::string released;            ///< inspected end (Standing::end)
  std::string left;                ///< interruption that was reported
  std::string harmless;            ///< end after which another may begin
  std::deque<Decision> decisions;  ///< newest last

  /// Also after an end that was released.
  void hold_from(const Hold& since);
  bool is_closed(const std::string& entry, const std::string& day) const;
  void close(const std::string& entry, const std::string& day, bool missed);
  void reopen_missed(const std::string& entry, const std::string& day);
  void add(Decision decision);
};

std::string to_text(const ScheduleState& state);
/// Inverse of to_text(); an initial state for an empty text. Throws std::runtime_error where it is damaged.
ScheduleState schedule_state_from(const std::string& text);

}  // namespace cellcal::daemon
