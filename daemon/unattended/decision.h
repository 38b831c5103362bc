#pragma once
// What the schedule has decided, and why. Typed until the edge: decision_words.cc makes the sentences.

#include <cstdint>
#include <string>

#include "daemon/unattended/calendar.h"

namespace cellcal::daemon {

enum class Verb {
  kBegun,    ///< a session began
  kResumed,  ///< one goes on after a harmless failure
  kWaiting,  ///< not yet, and the window still lasts
  kRefused,  ///< not in this window, or not on this request
  kMissed,   ///< the window is over, and nothing was begun in it
  kStopped,  ///< the window is over: the session was stopped
  kEnded,    ///< the session that it had begun has ended
  kHeld,     ///< no session begins until it is released
  kReleased  ///< by an operator, or since the clock is synchronised again
};
enum class Why {
  kNothing,
  kUnattendedOff,         ///< [schedule] unattended is not true
  kNoProgramStart,        ///< nothing starts the controller's program: [schedule] program_start
  kFailedBefore,          ///< a session failed, harmfully
  kAbortedBefore,         ///< somebody stopped a session, or what was about to begin
  kLeftBefore,            ///< a session was interrupted: daemon killed, power off
  kBusy,                  ///< a session is under way
  kNoTimeLeft,            ///< it would run past the end of the window
  kOutsideWindow,         ///< asked for outside of it
  kNoSuchTime,            ///< clocks are set forward over all of it
  kNotRunning,            ///< the daemon was not
  kClockSet,              ///< the wall clock was set over it
  kClockStepped,          ///< the wall clock was set, and nobody has looked at it since
  kClockNotSynchronised,  ///< not since this computer's start, and nobody has looked at it
  kClockAgrees,           ///< it has agreed with its time source for long enough
  kCannotBegin,           ///< file or configuration; see detail
  kNotOnDisk,             ///< the decision could not be recorded
  kDone,
  kHarmless,     ///< failed, and may be resumed
  kHarmful,      ///< failed, and waits for somebody
  kResumesUsed,  ///< failed harmlessly, once too often
  kWindowOver
};
const char* to_string(Verb verb);
const char* to_string(Why why);
/// Throws std::runtime_error where there is none of that name.
Verb verb_of(const std::string& name);
Why why_of(const std::string& name);

struct Decision {
  UtcSeconds at = 0;
  std::string entry;  ///< empty: of the schedule as a whole
  std::string night;  ///< day on which its window begins; empty: of none
  Verb verb = Verb::kWaiting;
  Why why = Why::kNothing;
  std::int64_t session = 0;  ///< 0: of none
  std::string detail;        ///< evidence: a failure, a file's error, a name
  double figure_s = 0.0;     ///< time that it would take, or by which a clock was set

  bool operator==(const Decision&) const = default;
};

/// One line, with what to do.
std::string words(const Decision& decision);

}  // namespace cellcal::daemon
