#include "calib/model/iso_time.h"

#include <fmt/format.h>

#include <ctime>

namespace cellcal::calib {

namespace {

/// Parses from the front of a text; `ok` becomes false at the first mismatch.
struct Scan {
  std::string_view rest;
  bool ok = true;

  bool take(char c) {
    if (!rest.starts_with(c)) return false;
    rest.remove_prefix(1);
    return true;
  }
  int digits(std::size_t count) {
    int value = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (rest.empty() || rest.front() < '0' || rest.front() > '9') {
        ok = false;
        return 0;
      }
      value = 10 * value + (rest.front() - '0');
      rest.remove_prefix(1);
    }
    return value;
  }
  int up_to(std::size_t count, int most) {
    const int value = digits(count);
    ok = ok && value <= most;
    return value;
  }
  double fraction() {
    double value = 0.0, unit = 0.1;
    const std::size_t before = rest.size();
    for (; !rest.empty() && rest.front() >= '0' && rest.front() <= '9'; unit /= 10.0) {
      value += unit * (rest.front() - '0');
      rest.remove_prefix(1);
    }
    ok = ok && rest.size() < before;
    return value;
  }
};

/// Time of day; a minute with a leap second has 61 seconds.
double time_of_day_s(Scan& scan) {
  double seconds = 3600.0 * scan.up_to(2, 24);
  const bool colons = scan.take(':');
  seconds += 60.0 * scan.up_to(2, 59);
  if (colons ? scan.take(':')
             : !scan.rest.empty() && scan.rest.front() >= '0' && scan.rest.front() <= '9')
    seconds += scan.up_to(2, 60);
  if (scan.take('.') || scan.take(',')) seconds += scan.fraction();
  return seconds;
}

/// Offset to subtract for UTC.
double zone_s(Scan& scan) {
  if (scan.rest.empty() || scan.take('Z')) return 0.0;
  const bool west = scan.take('-');
  if (!west && !scan.take('+')) {
    scan.ok = false;
    return 0.0;
  }
  double seconds = 3600.0 * scan.up_to(2, 24);
  scan.take(':');
  if (!scan.rest.empty()) seconds += 60.0 * scan.up_to(2, 59);
  return west ? -seconds : seconds;
}

std::string up_to_seconds(std::chrono::sys_seconds time) {
  const std::time_t since_1970 = time.time_since_epoch().count();
  std::tm utc{};
  ::gmtime_r(&since_1970, &utc);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}", utc.tm_year + 1900, utc.tm_mon + 1,
                     utc.tm_mday, utc.tm_hour, utc.tm_min, utc.tm_sec);
}

}  // namespace

std::optional<double> seconds_of(std::string_view iso) {
  namespace chrono = std::chrono;
  Scan scan{iso};
  const int year = scan.digits(4);
  const bool dashes = scan.take('-');
  const int month = scan.digits(2);
  if (dashes && !scan.take('-')) return {};
  const int day = scan.digits(2);
  const chrono::year_month_day date{chrono::year(year), chrono::month(static_cast<unsigned>(month)),
                                    chrono::day(static_cast<unsigned>(day))};
  if (!scan.ok || !date.ok()) return {};
  double seconds = 86400.0 * chrono::sys_days(date).time_since_epoch().count();
  if (!scan.rest.empty()) {
    if (!scan.take('T') && !scan.take(' ')) return {};
    seconds += time_of_day_s(scan);
    seconds -= zone_s(scan);
  }
  if (!scan.ok || !scan.rest.empty()) return {};
  return seconds;
}

std::string utc_text(std::chrono::sys_seconds time) { return up_to_seconds(time) + "Z"; }

std::string utc_text(std::chrono::sys_time<std::chrono::milliseconds> time) {
  const auto whole = std::chrono::floor<std::chrono::seconds>(time);
  return fmt::format("{}.{:03}Z", up_to_seconds(whole), (time - whole).count());
}

}  // namespace cellcal::calib
