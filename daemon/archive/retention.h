#pragma once
// Retention rule for raw data of old sessions.

#include <cstdint>
#include <optional>

#include "daemon/journal/journal.h"

namespace cellcal::daemon {

struct RetentionRule {
  std::optional<int> days;          ///< drops raw rows of sessions that ended earlier
  std::optional<double> megabytes;  ///< drops the oldest raw rows until the journal is not larger

  bool any() const { return days || megabytes; }
  bool operator==(const RetentionRule&) const = default;
};

/// `now`: seconds since 1970, UTC.
RetentionLimits limits_of(const RetentionRule& rule, std::int64_t now);

}  // namespace cellcal::daemon
