#pragma once
// Where a session's time went, as a person reads it.

#include <cstdint>
#include <span>
#include <string>

namespace cellcal::daemon {

struct ActivityRow {
  std::string activity, driver;
  std::int64_t count = 0;
  double total_s = 0.0, worst_s = 0.0;
};

/// A row per activity that took place, the largest first: seconds per touch, how often, each and at
/// worst, in all, share, and what it hangs on. Ends with a line break.
std::string times_words(std::int64_t touches, std::span<const ActivityRow> rows);

}  // namespace cellcal::daemon
