#pragma once
// What may be dropped of old sessions, as an owner states it.

#include <cstdint>
#include <optional>

#include "daemon/journal/journal.h"

namespace cellcal::daemon {

struct RetentionRule {
  std::optional<int> days;          ///< raw rows of sessions that ended before
  std::optional<double> megabytes;  ///< the oldest raw rows, until the journal uses no more

  bool any() const { return days || megabytes; }
  bool operator==(const RetentionRule&) const = default;
};

/// `now`: seconds since 1970, UTC.
RetentionLimits limits_of(const RetentionRule& rule, std::int64_t now);

}  // namespace cellcal::daemon
