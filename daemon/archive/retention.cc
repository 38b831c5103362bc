#include "daemon/archive/retention.h"

#include <fmt/format.h>

#include <cmath>
#include <ctime>

namespace cellcal::daemon {

namespace {

constexpr std::int64_t kDay = 86400;
constexpr double kMegabyte = 1e6;

}  // namespace

RetentionLimits limits_of(const RetentionRule& rule, std::int64_t now) {
  RetentionLimits limits;
  if (rule.days) {
    const std::time_t before = now - *rule.days * kDay;
    std::tm utc{};
    ::gmtime_r(&before, &utc);
    limits.ended_before =
        fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.000Z", utc.tm_year + 1900, utc.tm_mon + 1,
                    utc.tm_mday, utc.tm_hour, utc.tm_min, utc.tm_sec);
  }
  if (rule.megabytes) limits.bytes = std::llround(*rule.megabytes * kMegabyte);
  return limits;
}

}  // namespace cellcal::daemon
