#include "daemon/config/schedule_config.h"

#include <algorithm>

#include "calib/files/text.h"
#include "daemon/config/config_values.h"

namespace cellcal::daemon {

namespace {

using calib::TomlTable;

constexpr std::size_t kMostSessions = 32, kLongestScheduleName = 40;
constexpr std::array<std::string_view, 7> kDays{"sun", "mon", "tue", "wed", "thu", "fri", "sat"};
constexpr const char* kKeys[] = {"name",  "kind",    "cell",  "days",    "from",   "to",
                                 "begin", "touches", "check", "goal_mm", "minutes"};
constexpr int kMinutesPerHour = 60, kHoursPerDay = 24;

/// "22:30" as minutes since midnight.
int read_time_of_day(const TomlTable& table, const char* key) {
  const std::string text = table.string(key);
  const auto digit = [&](std::size_t at) { return '0' <= text[at] && text[at] <= '9'; };
  const bool sound =
      text.size() == 5 && digit(0) && digit(1) && text[2] == ':' && digit(3) && digit(4);
  const auto number = [&](std::size_t at) { return 10 * (text[at] - '0') + text[at + 1] - '0'; };
  if (!sound || number(0) >= kHoursPerDay || number(3) >= kMinutesPerHour) {
    table.fail(key, "\"" + calib::shown(text) +
                        "\" is not a time of day: write hours and minutes, \"00:00\" to \"23:59\"");
  }
  return number(0) * kMinutesPerHour + number(3);
}

std::array<bool, 7> read_days(const TomlTable& table) {
  std::array<bool, 7> days{};
  const std::vector<std::string> given = table.strings("days");
  if (given.empty()) table.fail("days", "names no day: leave it out for all of them");
  for (const std::string& name : given) {
    const auto day = std::find(kDays.begin(), kDays.end(), name);
    if (day == kDays.end()) {
      table.fail("days", "\"" + calib::shown(name) +
                             "\" is not a day. Use sun, mon, tue, wed, thu, fri, sat");
    }
    days[static_cast<std::size_t>(day - kDays.begin())] = true;
  }
  return days;
}

WeeklyWindow read_window(const TomlTable& table) {
  WeeklyWindow window;
  if (table.has("days")) window.days = read_days(table);
  window.from_min = read_time_of_day(table, "from");
  window.to_min = read_time_of_day(table, "to");
  if (window.from_min == window.to_min)
    table.fail("to", "must be another time of day than from: a window has a begin and an end");
  return window;
}

/// The name is used in lists, in the log and on command lines.
std::string read_session_name(const TomlTable& table) {
  const std::string name = table.string("name");
  const bool sound =
      !name.empty() && name.size() <= kLongestScheduleName && name.front() != '-' &&
      name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") ==
          std::string::npos;
  if (!sound) {
    table.fail("name", "\"" + calib::shown(name) +
                           "\" must have 1 to 40 letters, digits, - and _, such as \"nightly\"");
  }
  return name;
}

void refuse_touches_of_others(const TomlTable& table, const ScheduledSession& session) {
  if (session.kind == "calibrate") return;
  for (const char* key : {"touches", "check", "goal_mm"}) {
    if (table.has(key))
      table.fail(key, "is of kind = \"calibrate\": a session of another kind has its own touches");
  }
}

ScheduledSession read_session(const TomlTable& table) {
  ScheduledSession session;
  session.name = read_session_name(table);
  if (table.has("kind")) session.kind = table.word("kind", {"calibrate", "check", "qualify"});
  session.cell = read_path(table, "cell");
  session.window = read_window(table);
  session.on_request =
      table.has("begin") && table.word("begin", {"by itself", "on request"}) == "on request";
  refuse_touches_of_others(table, session);
  if (table.has("touches")) session.touches = static_cast<int>(table.integer("touches", 4, 2000));
  if (table.has("check")) session.check = static_cast<int>(table.integer("check", 0, 2000));
  if (table.has("goal_mm")) session.goal_mm = table.number("goal_mm", {0.01, 10.0});
  if (table.has("minutes")) session.minutes = table.number("minutes", {0.1, 1440.0});
  table.refuse_unknown();
  return session;
}

/// A table with all keys commented out is an example and ignored.
bool has_entries(const TomlTable& table) {
  for (const char* key : kKeys)
    if (table.has(key)) return true;
  table.refuse_unknown();
  return false;
}

ProgramStart read_program_start(const TomlTable& table) {
  if (!table.has("program_start")) return ProgramStart::kNone;
  const std::string word = table.word("program_start", {"none", "left running", "cell", "run"});
  return word == "cell"           ? ProgramStart::kCell
         : word == "run"          ? ProgramStart::kRun
         : word == "left running" ? ProgramStart::kLeftRunning
                                  : ProgramStart::kNone;
}

}  // namespace

ScheduleConfig read_schedule(const TomlTable& table) {
  ScheduleConfig schedule;
  schedule.program_start = read_program_start(table);
  schedule.unattended = table.boolean_or("unattended", false);
  schedule.responsible = table.string_or("responsible", "");
  if (schedule.unattended && schedule.responsible.empty()) {
    table.fail(
        "responsible",
        "is missing: with unattended = true sessions begin without a person. Name the person "
        "responsible for a closed and clear cell within the windows, and how to reach them");
  }
  schedule.resumes = static_cast<int>(table.integer_or("resumes", 0, 0, 20));
  schedule.resume_wait_s = table.number_or("resume_wait_s", schedule.resume_wait_s, {10.0, 3600.0});
  const std::vector<TomlTable> sessions = table.tables("session");
  if (sessions.size() > kMostSessions)
    table.fail("session", "has " + std::to_string(sessions.size()) + " entries, at most 32 can be");
  for (const TomlTable& one : sessions) {
    if (!has_entries(one)) continue;
    ScheduledSession session = read_session(one);
    const auto same = [&](const ScheduledSession& other) { return other.name == session.name; };
    if (std::any_of(schedule.sessions.begin(), schedule.sessions.end(), same))
      one.fail("name", "\"" + session.name + "\" is the name of another session of the schedule");
    schedule.sessions.push_back(std::move(session));
  }
  table.refuse_unknown();
  return schedule;
}

}  // namespace cellcal::daemon
