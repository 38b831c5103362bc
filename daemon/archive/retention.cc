#include "daemon/archive/retention.h"

#include <chrono>
#include <cmath>

#include "calib/model/iso_time.h"

namespace cellcal::daemon {

namespace {

constexpr std::int64_t kDay = 86400;
constexpr double kMegabyte = 1e6;

}  // namespace

RetentionLimits limits_of(const RetentionRule& rule, std::int64_t now) {
  RetentionLimits limits;
  if (rule.days) {
    const std::chrono::sys_time<std::chrono::milliseconds> before{
        std::chrono::seconds(now - *rule.days * kDay)};
    limits.ended_before = calib::utc_text(before);
  }
  if (rule.megabytes) limits.bytes = std::llround(*rule.megabytes * kMegabyte);
  return limits;
}

}  // namespace cellcal::daemon
