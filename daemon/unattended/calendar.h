#pragma once
// Instants of a weekly window in UTC. The time zone is the system's (TZ, /etc/localtime).
//
// Every instant of a night lies within the window by local time as well. Where clocks are set back and a time
// of day occurs twice, a window begins at the second `from` and ends at the first `to` after it; where they
// are set forward, a skipped time is the instant of the change. A window that is skipped entirely does not
// exist: its night is empty.

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "daemon/config/schedule_config.h"

namespace cellcal::daemon {

/// Seconds since 1970, UTC.
using UtcSeconds = std::int64_t;

/// One window, identified by the day on which it begins: [begins, ends).
struct Night {
  std::chrono::sys_days day{};  ///< local calendar day
  UtcSeconds begins = 0, ends = 0;

  bool exists() const { return begins < ends; }
  bool has(UtcSeconds at) const { return begins <= at && at < ends; }
  bool operator==(const Night&) const = default;
};

Night night_of(const WeeklyWindow& window, std::chrono::sys_days day);
/// Windows that end after `after` and begin at `until` or before; empty ones at the instant at which they
/// would be.
std::vector<Night> nights(const WeeklyWindow& window, UtcSeconds after, UtcSeconds until);
/// First existing window that begins after this instant, within the next weeks.
Night next_night(const WeeklyWindow& window, UtcSeconds after);

/// "2026-11-22", day of a night.
std::string to_string(std::chrono::sys_days day);
/// "2026-11-22 22:00", local time.
std::string local_time(UtcSeconds at);

}  // namespace cellcal::daemon
