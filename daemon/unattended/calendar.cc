#include "daemon/unattended/calendar.h"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>

namespace cellcal::daemon {

namespace {

constexpr std::int64_t kDay = 86400, kMinute = 60;
/// Above the largest offset from UTC; clock changes are farther apart.
constexpr std::int64_t kFar = kDay;
constexpr int kWeeksAhead = 5;

std::tm local(UtcSeconds at) {
  const std::time_t time = at;
  std::tm fields{};
  ::localtime_r(&time, &fields);
  return fields;
}

/// Offset of local time from UTC.
std::int64_t offset_at(UtcSeconds at) { return local(at).tm_gmtoff; }

/// Instants at which local clocks show a given time, which is passed as if in UTC.
struct Showing {
  UtcSeconds first = 0, last = 0;
};
Showing showing(std::int64_t wall) {
  const std::int64_t before = offset_at(wall - kFar), after = offset_at(wall + kFar);
  const UtcSeconds early = wall - before, late = wall - after;
  const bool by_early = offset_at(early) == before, by_late = offset_at(late) == after;
  if (by_early && by_late) return {std::min(early, late), std::max(early, late)};
  if (by_early) return {early, early};
  if (by_late) return {late, late};
  // Skipped local time: finds the instant of the change, between wall - after and wall - before.
  UtcSeconds old = late, set = early;
  while (set - old > 1) {
    const UtcSeconds middle = old + (set - old) / 2;
    (offset_at(middle) == before ? old : set) = middle;
  }
  return {set, set};
}

std::int64_t wall_of(std::chrono::sys_days day, int minutes) {
  return day.time_since_epoch().count() * kDay + minutes * kMinute;
}

std::chrono::sys_days local_day(UtcSeconds at) {
  const std::int64_t wall = at + offset_at(at);
  const std::int64_t days = wall >= 0 ? wall / kDay : -((-wall + kDay - 1) / kDay);
  return std::chrono::sys_days(std::chrono::days(days));
}

bool begins_on(const WeeklyWindow& window, std::chrono::sys_days day) {
  return window.days.at(std::chrono::weekday(day).c_encoding());
}

}  // namespace

Night night_of(const WeeklyWindow& window, std::chrono::sys_days day) {
  ::tzset();  // the zone may have been changed
  const bool over_midnight = window.to_min <= window.from_min;
  const std::chrono::sys_days last = day + std::chrono::days(over_midnight ? 1 : 0);
  const UtcSeconds begins = showing(wall_of(day, window.from_min)).last;
  const Showing end = showing(wall_of(last, window.to_min));
  return {day, begins, std::max(begins, end.first > begins ? end.first : end.last)};
}

std::vector<Night> nights(const WeeklyWindow& window, UtcSeconds after, UtcSeconds until) {
  std::vector<Night> found;
  const std::chrono::sys_days end = local_day(until) + std::chrono::days(1);
  for (auto day = local_day(after) - std::chrono::days(2); day <= end;
       day += std::chrono::days(1)) {
    if (!begins_on(window, day)) continue;
    const Night night = night_of(window, day);
    if (night.ends > after && night.begins <= until) found.push_back(night);
  }
  return found;
}

Night next_night(const WeeklyWindow& window, UtcSeconds after) {
  for (const Night& night : nights(window, after, after + kWeeksAhead * 7 * kDay))
    if (night.exists() && night.begins > after) return night;
  return {};
}

std::string to_string(std::chrono::sys_days day) {
  const std::chrono::year_month_day date(day);
  return fmt::format("{:04}-{:02}-{:02}", static_cast<int>(date.year()),
                     static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()));
}

std::string local_time(UtcSeconds at) {
  const std::tm time = local(at);
  return fmt::format("{:04}-{:02}-{:02} {:02}:{:02}", time.tm_year + 1900, time.tm_mon + 1,
                     time.tm_mday, time.tm_hour, time.tm_min);
}

}  // namespace cellcal::daemon
