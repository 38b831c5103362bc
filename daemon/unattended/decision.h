#pragma once
// Decisions of the schedule with their reasons. Typed until the edge; their words are in the catalogues.

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/model/enum_table.h"
#include "calib/words/phrase.h"
#include "daemon/config/unattended_config.h"
#include "daemon/session/failure.h"

namespace cellcal::daemon {

// Instants of a weekly window in UTC. The time zone is the system's (TZ, /etc/localtime).
//
// Every instant of an occurrence lies within the window by local time as well. Where clocks are set back and a time
// of day occurs twice, a window begins at the second `from` and ends at the first `to` after it; where they
// are set forward, a skipped time is the instant of the change. A window that is skipped entirely does not
// exist: it is empty.

/// Seconds since 1970, UTC.
using UtcSeconds = std::int64_t;

/// One occurrence of a weekly window, identified by the day on which it begins: [begins, ends).
struct Window {
  std::chrono::sys_days day{};  ///< local calendar day
  UtcSeconds begins = 0, ends = 0;

  bool exists() const { return begins < ends; }
  bool has(UtcSeconds at) const { return begins <= at && at < ends; }
  bool operator==(const Window&) const = default;
};

Window window_on(const WeeklyWindow& weekly, std::chrono::sys_days day);
/// Windows that end after `after` and begin at `until` or before; empty ones at the instant at which they
/// would be.
std::vector<Window> windows_between(const WeeklyWindow& weekly, UtcSeconds after, UtcSeconds until);
/// First existing window that begins after this instant, within the next weeks.
Window next_window(const WeeklyWindow& weekly, UtcSeconds after);

/// "2026-11-22", day of a window.
std::string to_string(std::chrono::sys_days day);
/// "2026-11-22 22:00", local time.
std::string local_time(UtcSeconds at);

enum class Verb {
  kBegun,    ///< a session began
  kResumed,  ///< a session resumed after a harmless failure
  kWaiting,  ///< not yet, while the window lasts
  kRefused,  ///< not in this window, or not on this request
  kMissed,   ///< the window has passed without a session
  kStopped,  ///< the window has passed: the session was stopped
  kEnded,    ///< the session begun by the schedule has ended
  kHeld,     ///< no session begins until released
  kReleased  ///< by an operator, or after renewed clock synchronisation
};
enum class Why {
  kNothing,
  kUnattendedOff,         ///< [schedule] unattended is not true
  kNoProgramStart,        ///< [schedule] program_start is none
  kFailedBefore,          ///< a session failed, not harmlessly
  kAbortedBefore,         ///< a person stopped a session, or its start
  kInterruptedBefore,     ///< a session was interrupted: daemon killed, power failure
  kPastUnknown,           ///< the journal is new, or an older copy
  kBusy,                  ///< a session is under way
  kNoTimeLeft,            ///< would exceed the end of the window
  kOutsideWindow,         ///< requested outside of it
  kNoSuchTime,            ///< skipped by a clock change
  kDaemonNotRunning,      ///< the daemon was not running
  kClockSet,              ///< the wall clock was set across it
  kClockStepped,          ///< the wall clock was set, and not confirmed since
  kClockNotSynchronised,  ///< not since boot, and not confirmed
  kClockAgrees,           ///< synchronised for the required time
  kCannotBegin,           ///< file or configuration; see detail
  kNotOnDisk,             ///< the decision could not be recorded
  kDone,
  kHarmless,     ///< failed, and may be resumed
  kHarmful,      ///< failed, and requires an operator
  kResumesUsed,  ///< failed harmlessly, resumes used up
  kWindowOver
};
constexpr const char* to_string(Verb verb) { return own_name<'-'>(verb); }
/// "no-time-left"
constexpr const char* to_string(Why why) { return own_name<'-'>(why); }
/// Throw std::runtime_error for an unknown name.
Verb verb_of(const std::string& name);
Why why_of(const std::string& name);

struct Decision {
  UtcSeconds at = 0;
  std::string entry{};  ///< empty: the whole schedule
  std::string day{};    ///< day on which its window begins; empty: none
  Verb verb = Verb::kWaiting;
  Why why = Why::kNothing;
  std::int64_t session = 0;  ///< 0: none
  calib::Phrase detail{};    ///< evidence: a failure, a file's error, a name
  double figure_s = 0.0;     ///< expected duration, or step of the clock

  bool operator==(const Decision&) const = default;
};

/// With the remedy.
calib::Phrase phrase(const Decision& decision);
/// One line.
std::string words(const Decision& decision, const calib::Language& language = {});

// Permitted unattended actions after a failed session. One table, with the reason for each kind of failure;
// everything else requires an operator, however rare.
//
// `resume`: continues as an operator would: devices reopened, identified and self-tested, the arm referenced
// anew, the path planned from its current position. Permitted only where the arm was commanded to rest,
// without contact, and the fault was in a link or before the first motion. `begin`: a session of a later
// window may begin. Also permitted where the cell was not involved.

struct FailurePolicy {
  FailureKind failure;
  /// Cause in the link of robot or sensor; none: any.
  std::optional<drivers::Interruption> by;
  bool resume, begin;
  const char* reason;
};

/// Every kind of failure with its possible causes.
std::span<const FailurePolicy> failure_policies();
/// Row of this failure.
const FailurePolicy& aftermath(FailureKind failure, drivers::Interruption by);

}  // namespace cellcal::daemon
