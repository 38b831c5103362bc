#pragma once
// When a weekly window is, in time that goes on whatever the clocks on the wall are set to. The time zone is
// the system's (TZ, /etc/localtime).
//
// Every moment of a night lies inside the window by the clock on the wall as well. So where clocks are set
// back, and a time of day comes twice, a window begins at the second `from` and ends at the first `to` behind it;
// where they are set forward, a time that is left out is the moment at which they are. A window that lies wholly
// in what is left out does not exist that night: its night is empty.

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "daemon/config/schedule_config.h"

namespace cellcal::daemon {

/// Seconds since 1970, UTC.
using UtcSeconds = std::int64_t;

/// One window, by the day on which it begins. From `begins` on, until before `ends`.
struct Night {
  std::chrono::sys_days day{};  ///< of the local calendar
  UtcSeconds begins = 0, ends = 0;

  bool exists() const { return begins < ends; }
  bool has(UtcSeconds at) const { return begins <= at && at < ends; }
  bool operator==(const Night&) const = default;
};

Night night_of(const WeeklyWindow& window, std::chrono::sys_days day);
/// Those that end behind `after` and begin at `until` or before; empty ones by the moment at which they would be.
std::vector<Night> nights(const WeeklyWindow& window, UtcSeconds after, UtcSeconds until);
/// The first that exists and begins behind this moment; within the next weeks.
Night next_night(const WeeklyWindow& window, UtcSeconds after);

/// "2026-11-22", of a night.
std::string to_string(std::chrono::sys_days day);
/// "2026-11-22 22:00", as the clock on the wall shows it.
std::string local_time(UtcSeconds at);

}  // namespace cellcal::daemon
