#include <fmt/format.h>

#include <array>
#include <stdexcept>

#include "daemon/files/atomic_file.h"
#include "daemon/unattended/decision.h"

namespace cellcal::daemon {

namespace {

template <class Value>
struct Named {
  Value value;
  const char* name;
};

constexpr std::array kVerbs{Named{Verb::kBegun, "begun"},      Named{Verb::kResumed, "resumed"},
                            Named{Verb::kWaiting, "waiting"},  Named{Verb::kRefused, "refused"},
                            Named{Verb::kMissed, "missed"},    Named{Verb::kStopped, "stopped"},
                            Named{Verb::kEnded, "ended"},      Named{Verb::kHeld, "held"},
                            Named{Verb::kReleased, "released"}};

constexpr std::array kReasons{Named{Why::kNothing, "nothing"},
                              Named{Why::kUnattendedOff, "unattended-off"},
                              Named{Why::kNoProgramStart, "no-program-start"},
                              Named{Why::kFailedBefore, "failed-before"},
                              Named{Why::kAbortedBefore, "aborted-before"},
                              Named{Why::kLeftBefore, "interrupted-before"},
                              Named{Why::kBusy, "busy"},
                              Named{Why::kNoTimeLeft, "no-time-left"},
                              Named{Why::kOutsideWindow, "outside-window"},
                              Named{Why::kNoSuchTime, "no-such-time"},
                              Named{Why::kNotRunning, "daemon-not-running"},
                              Named{Why::kClockSet, "clock-set"},
                              Named{Why::kClockStepped, "clock-stepped"},
                              Named{Why::kClockNotSynchronised, "clock-not-synchronised"},
                              Named{Why::kClockAgrees, "clock-agrees"},
                              Named{Why::kCannotBegin, "cannot-begin"},
                              Named{Why::kNotOnDisk, "not-on-disk"},
                              Named{Why::kDone, "done"},
                              Named{Why::kHarmless, "harmless"},
                              Named{Why::kHarmful, "harmful"},
                              Named{Why::kResumesUsed, "resumes-used"},
                              Named{Why::kWindowOver, "window-over"}};

template <class Value, std::size_t N>
const char* name_in(const std::array<Named<Value>, N>& names, Value value) {
  for (const auto& one : names)
    if (one.value == value) return one.name;
  return "unknown";
}

template <class Value, std::size_t N>
Value value_in(const std::array<Named<Value>, N>& names, const std::string& name) {
  for (const auto& one : names)
    if (name == one.name) return one.value;
  throw std::runtime_error("\"" + printable(name) + "\" is not a decision");
}

std::string minutes(double seconds) { return fmt::format("{:.1f} min", seconds / 60.0); }

constexpr const char* kRelease =
    "Inspect cell and arm, then: 'cellcal schedule --release', or run a session to its end";

constexpr const char* kCheckClock =
    "Check date and time, then: 'cellcal schedule --release'; or connect a time source (NTP): 10 min of "
    "agreement release it";

std::string why_words(const Decision& d) {
  switch (d.why) {
    case Why::kNothing:
      return d.detail;
    case Why::kUnattendedOff:
      return "[schedule] unattended is not true: nothing moves without a person";
    case Why::kNoProgramStart:
      return "nothing starts the controller's program without a person. Set it up "
             "(drivers/kuka/krl/README.md, 'Unattended at night'), then [schedule] program_start";
    case Why::kFailedBefore:
      return fmt::format("session {} failed: {}. {}", d.session, d.detail, kRelease);
    case Why::kAbortedBefore:
      return d.session > 0 ? fmt::format("session {} was stopped by hand. {}", d.session, kRelease)
                           : std::string("'abort' was given. ") + kRelease;
    case Why::kLeftBefore:
      return fmt::format("session {} was interrupted. {}", d.session, kRelease);
    case Why::kBusy:
      return "another session is under way";
    case Why::kNoTimeLeft:
      return fmt::format(
          "{} expected, ends after the window. Begin the window earlier, or correct minutes",
          minutes(d.figure_s));
    case Why::kOutsideWindow:
      return "not within its window";
    case Why::kNoSuchTime:
      return "window skipped: the clock change covers it entirely";
    case Why::kNotRunning:
      return "cellcald was not running within the window";
    case Why::kClockSet:
      return "this computer's clock was set across the window. Check its time source";
    case Why::kClockStepped:
      return fmt::format("this computer's clock was set by {:+.0f} s. {}", d.figure_s, kCheckClock);
    case Why::kClockNotSynchronised:
      return std::string("this computer's clock is not synchronised since its start. ") +
             kCheckClock;
    case Why::kClockAgrees:
      return fmt::format("the clock has agreed with its time source for {:.0f} min",
                         d.figure_s / 60.0);
    case Why::kCannotBegin:
      return d.detail;
    case Why::kNotOnDisk:
      return d.detail + ". A session that cannot be recorded is not started. Check the disk";
    case Why::kDone:
      return "done";
    case Why::kHarmless:
      return d.detail;
    case Why::kHarmful:
      return d.detail;
    case Why::kResumesUsed:
      return d.detail + ". All automatic resumes are used ([schedule] resumes)";
    case Why::kWindowOver:
      return "the window is over";
  }
  return d.detail;
}

std::string verb_words(const Decision& d) {
  switch (d.verb) {
    case Verb::kBegun:
      return fmt::format("session {} begun", d.session);
    case Verb::kResumed:
      return fmt::format("session {} resumed", d.session);
    case Verb::kWaiting:
      return "waiting";
    case Verb::kRefused:
      return "not begun";
    case Verb::kMissed:
      return "missed";
    case Verb::kStopped:
      return fmt::format("session {} stopped", d.session);
    case Verb::kEnded:
      return fmt::format("session {} ended", d.session);
    case Verb::kHeld:
      return "on hold, no automatic start";
    case Verb::kReleased:
      return "released";
  }
  return "";
}

}  // namespace

const char* to_string(Verb verb) { return name_in(kVerbs, verb); }
const char* to_string(Why why) { return name_in(kReasons, why); }
Verb verb_of(const std::string& name) { return value_in(kVerbs, name); }
Why why_of(const std::string& name) { return value_in(kReasons, name); }

std::string words(const Decision& decision) {
  std::string text = verb_words(decision);
  if (const std::string why = why_words(decision); !why.empty()) text += ": " + why;
  return printable(text);
}

}  // namespace cellcal::daemon
