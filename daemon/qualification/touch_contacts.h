#pragma once
// The contacts of each touch, out of a session's readings.

#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "daemon/session/action.h"
#include "daemon/qualification/contact_delay.h"

namespace cellcal::daemon {

/// Tip travel from the stand-off [m]. A touch that was begun anew (after a retry, by a resumed session)
/// counts from its last fast contact on.
struct TouchContacts {
  std::optional<double> fast_m;
  std::vector<double> slow_m;

  double slow_mean_m() const;  ///< there is one
};

/// By index of the touch; `readings` as they were made. What is no number is left aside.
std::map<std::size_t, TouchContacts> contacts_of(std::span<const RecordReading> readings);

/// Of the first `touches`, those that have contacts at both speeds.
std::vector<FastAndSlow> fast_and_slow(std::span<const RecordReading> readings, std::size_t touches);

}  // namespace cellcal::daemon
