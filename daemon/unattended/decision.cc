#include "daemon/unattended/decision.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <stdexcept>

#include "calib/model/enum_table.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

using drivers::Interruption;
using F = FailureKind;
constexpr std::nullopt_t kAny = std::nullopt;

// clang-format off
constexpr std::array kTable{
//                                                     resume begin
FailurePolicy{F::kComputerBusy,      kAny, true,  true,  "robot and sensor were sound; this computer was late"},
FailurePolicy{F::kRobotSilent,       Interruption::kPacketsStopped, true,  true,  "the arm holds without replies; the link is opened anew"},
FailurePolicy{F::kRobotSilent,       Interruption::kOther,          false, false, "program ended or stopped, connection closed: possibly by a person"},
FailurePolicy{F::kRobotSilent,       Interruption::kNone,           false, false, "no cause is known"},
FailurePolicy{F::kContactSilent,     Interruption::kPacketsStopped, true,  true,  "the arm was stopped; the sensor repeats its self-test before any motion"},
FailurePolicy{F::kContactSilent,     Interruption::kUnheard,        true,  true,  "as above; whether this computer was late remained open"},
FailurePolicy{F::kContactSilent,     kAny, false, false, "its port is lost, or no cause is known: possibly unplugged by a person"},
FailurePolicy{F::kDevice,            kAny, true,  true,  "nothing has moved: the port may be back"},
FailurePolicy{F::kLinkNotReady,      kAny, true,  true,  "nothing has moved: the link may come later"},
FailurePolicy{F::kAttended,          kAny, false, true,  "nothing has moved; a person works at the robot"},
FailurePolicy{F::kControllerTest,    kAny, true,  true,  "the arm rests out of contact; the controller's own test comes first"},
FailurePolicy{F::kIdentify,          kAny, false, true,  "the arm had finished; the same touches give the same answer"},
FailurePolicy{F::kContactFault,      kAny, false, false, "a wire or the sensor is to be repaired"},
FailurePolicy{F::kContactClosed,     kAny, false, false, "the tip touches something, or the line is shorted"},
FailurePolicy{F::kArmRefused,        kAny, false, false, "the sensor was already asked twice"},
FailurePolicy{F::kNoContact,         kAny, false, false, "the sphere is not there, or the circuit is dead"},
FailurePolicy{F::kContactTooEarly,   kAny, false, false, "an obstacle is missing in the plan"},
FailurePolicy{F::kUnexpectedContact, kAny, false, false, "the arm has met something that is not in the plan"},
FailurePolicy{F::kStillInContact,    kAny, false, false, "the tip may be stuck"},
FailurePolicy{F::kReadingsDisagree,  kAny, false, false, "dirt, a loose sphere or a loose tool remain"},
FailurePolicy{F::kTooManyRevoked,    kAny, false, false, "the noise remains"},
FailurePolicy{F::kMoveRefused,       kAny, false, false, "the same move would be refused again"},
FailurePolicy{F::kNotFollowing,      kAny, false, false, "emergency stop, drives off, collision: a person may be in the cell"},
FailurePolicy{F::kStoppedElsewhere,  kAny, false, false, "stopped by another party"},
FailurePolicy{F::kTimeout,           kAny, false, false, "the reason is not known"},
FailurePolicy{F::kStopUnconfirmed,   kAny, false, false, "the arm may still move"},
FailurePolicy{F::kPlan,              kAny, false, false, "no free path exists from the arm's position"},
FailurePolicy{F::kNotFound,          kAny, false, false, "a person has to measure the position of the sphere"},
FailurePolicy{F::kPlanChanged,       kAny, false, false, "a person has to begin another session"},
FailurePolicy{F::kJournal,           kAny, false, false, "nothing moves that cannot be recorded"},
FailurePolicy{F::kReport,            kAny, false, false, "the disk has to be checked first"},
FailurePolicy{F::kWindowOver,        kAny, false, true,  "the schedule stopped it: the arm rests"},
FailurePolicy{F::kDaemonStopped,     kAny, false, false, "a person stopped the daemon in mid-session"},
FailurePolicy{F::kUnexpectedEvent,   kAny, false, false, "the cause is not known"},
};
// clang-format on

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

bool begins_on(const WeeklyWindow& weekly, std::chrono::sys_days day) {
  return weekly.days.at(std::chrono::weekday(day).c_encoding());
}

template <class E>
E value_of(const std::string& name) {
  if (const auto value = by_own_name<E, '-'>(name)) return *value;
  throw std::runtime_error("\"" + printable(name) + "\" is not a decision");
}

}  // namespace

std::span<const FailurePolicy> failure_policies() { return kTable; }

const FailurePolicy& aftermath(FailureKind failure, Interruption by) {
  const auto row = std::find_if(kTable.begin(), kTable.end(), [&](const FailurePolicy& one) {
    return one.failure == failure && (!one.by || *one.by == by);
  });
  return row != kTable.end() ? *row : kTable.back();
}

Window window_on(const WeeklyWindow& weekly, std::chrono::sys_days day) {
  ::tzset();  // the zone may have been changed
  const bool over_midnight = weekly.to_min <= weekly.from_min;
  const std::chrono::sys_days last = day + std::chrono::days(over_midnight ? 1 : 0);
  const UtcSeconds begins = showing(wall_of(day, weekly.from_min)).last;
  const Showing end = showing(wall_of(last, weekly.to_min));
  return {day, begins, std::max(begins, end.first > begins ? end.first : end.last)};
}

std::vector<Window> windows_between(const WeeklyWindow& weekly, UtcSeconds after,
                                    UtcSeconds until) {
  std::vector<Window> found;
  const std::chrono::sys_days end = local_day(until) + std::chrono::days(1);
  for (auto day = local_day(after) - std::chrono::days(2); day <= end;
       day += std::chrono::days(1)) {
    if (!begins_on(weekly, day)) continue;
    const Window window = window_on(weekly, day);
    if (window.ends > after && window.begins <= until) found.push_back(window);
  }
  return found;
}

Window next_window(const WeeklyWindow& weekly, UtcSeconds after) {
  for (const Window& window : windows_between(weekly, after, after + kWeeksAhead * 7 * kDay))
    if (window.exists() && window.begins > after) return window;
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

Verb verb_of(const std::string& name) { return value_of<Verb>(name); }
Why why_of(const std::string& name) { return value_of<Why>(name); }

calib::Phrase phrase(const Decision& d) {
  const std::vector<calib::PhraseValue> values{{"session", d.session},
                                               {"detail", d.detail},
                                               {"min", d.figure_s / 60.0},
                                               {"s", d.figure_s},
                                               {"release", "say.schedule.release"},
                                               {"clock", "say.schedule.check_clock"}};
  std::string why = std::string("say.schedule.why.") + to_string(d.why);
  if (d.why == Why::kAbortedBefore && d.session == 0) why += ".start";
  // Reasons without words of their own are their evidence.
  return joined("say.join.colon", {std::string("say.schedule.") + to_string(d.verb), values},
                calib::sentence_of(why) ? calib::Phrase(why, values) : d.detail);
}

std::string words(const Decision& decision, const calib::Language& language) {
  return printable(calib::words(phrase(decision), language));
}

}  // namespace cellcal::daemon
