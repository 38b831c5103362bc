#pragma once
// What the schedule must not forget when the daemon ends: in the journal before anything begins, so that nothing
// begins twice and nothing releases what is held. Format "cellcal.schedule/1".

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/unattended/decision.h"

namespace cellcal::daemon {

/// That is decided for good: begun, refused or missed.
struct ClosedNight {
  std::string entry, night;
  bool missed = false;  ///< nothing was begun: a clock that is set back may bring it again
};

/// Wall clock and the clock since the computer's start, as they agreed.
struct ClockMark {
  std::string boot;  ///< tells this start of the computer from others; empty: none
  UtcSeconds utc = 0;
  double since_boot_s = 0.0;
};

/// The wall clock decides nothing.
struct ClockDoubt {
  Why why = Why::kClockStepped;
  double set_by_s = 0.0;
};

struct ScheduleState {
  UtcSeconds looked = 0;                    ///< everything before this has been looked at
  std::map<std::string, UtcSeconds> known;  ///< since when an entry is
  std::deque<ClosedNight> closed;           ///< newest last
  std::optional<std::int64_t> aborted;      ///< 'abort' was given when this was the newest session
  ClockMark clock;
  std::optional<ClockDoubt> clock_doubt;
  std::string released;            ///< the end behind which somebody has looked (Standing::end)
  std::string harmless;            ///< the end behind which another may begin
  std::deque<Decision> decisions;  ///< newest last

  bool is_closed(const std::string& entry, const std::string& night) const;
  void close(const std::string& entry, const std::string& night, bool missed);
  void reopen_missed(const std::string& entry, const std::string& night);
  void add(Decision decision);
};

std::string to_text(const ScheduleState& state);
/// What to_text() wrote; a new one of empty text. Throws std::runtime_error where it is damaged.
ScheduleState schedule_state_from(const std::string& text);

}  // namespace cellcal::daemon
