#pragma once
// Decisions of the schedule with their reasons. Typed until the edge: decision_words.cc formats the
// sentences.

#include <cstdint>
#include <string>

#include "daemon/unattended/calendar.h"

namespace cellcal::daemon {

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
  kLeftBefore,            ///< a session was interrupted: daemon killed, power failure
  kBusy,                  ///< a session is under way
  kNoTimeLeft,            ///< would exceed the end of the window
  kOutsideWindow,         ///< requested outside of it
  kNoSuchTime,            ///< skipped by a clock change
  kNotRunning,            ///< the daemon was not running
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
const char* to_string(Verb verb);
const char* to_string(Why why);
/// Throw std::runtime_error for an unknown name.
Verb verb_of(const std::string& name);
Why why_of(const std::string& name);

struct Decision {
  UtcSeconds at = 0;
  std::string entry;  ///< empty: the whole schedule
  std::string night;  ///< day on which its window begins; empty: none
  Verb verb = Verb::kWaiting;
  Why why = Why::kNothing;
  std::int64_t session = 0;  ///< 0: none
  std::string detail;        ///< evidence: a failure, a file's error, a name
  double figure_s = 0.0;     ///< expected duration, or step of the clock

  bool operator==(const Decision&) const = default;
};

/// One line, with the remedy.
std::string words(const Decision& decision);

}  // namespace cellcal::daemon
