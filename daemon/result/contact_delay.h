#pragma once
// Delay of the latched angles after the contact, from touches of one point at two speeds.
//
// A latch delayed by t reads a contact v t too deep. Every touch is searched fast first and then slowly along
// one line, so each gives
//
//   t = (depth of the fast contact - mean depth of the slow ones) / (v_fast - v_slow)
//
// A constant delay makes all touches of one speed too deep by the same amount, as a smaller effective radius
// would: 10 um per millisecond at 10 mm/s. The estimate separates the two as far as its touches permit
// (calib/estimate, (74)). This module monitors that the delay stays constant.

#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/session/action.h"

namespace cellcal::daemon {

/// Contacts of one touch: tip travel from the stand-off [m].
struct FastAndSlow {
  double fast_m = 0.0;
  double slow_m = 0.0;  ///< mean of the readings
};

/// Below this difference of speeds the noise of a touch (0.03 mm) dominates the delay.
inline constexpr double kLeastSpeedDifferenceMS = 0.001;

struct ContactDelay {
  double delay_s = 0.0;  ///< positive: angles of an instant after the contact
  double sigma_s = 0.0;  ///< 1 sigma
  int touches = 0;
};

/// Median over the touches, with its uncertainty from their scatter; robust against a touch that slipped.
/// None with fewer than five touches, or where the speeds hardly differ.
std::optional<ContactDelay> contact_delay(std::span<const FastAndSlow> touches, double fast_m_s,
                                          double slow_m_s);

/// "0.14 ± 0.02 ms (k=2) of 40 touches".
std::string in_words(const ContactDelay& delay);

/// Fault of `now`, by itself and compared with `before` (an earlier session); empty: none.
std::string complaint(const ContactDelay& now, const std::optional<ContactDelay>& before);

// Contacts of each touch from a session's readings.

/// Tip travel from the stand-off [m]. A restarted touch (after a retry, or in a resumed session) counts from
/// its last fast contact on.
struct TouchContacts {
  std::optional<double> fast_m;
  std::vector<double> slow_m;

  double slow_mean_m() const;  ///< requires at least one
};

/// By index of the touch; `readings` in order. Non-finite values are skipped.
std::map<std::size_t, TouchContacts> contacts_of(std::span<const RecordReading> readings);

/// Those of the first `touches` with contacts at both speeds.
std::vector<FastAndSlow> fast_and_slow(std::span<const RecordReading> readings,
                                       std::size_t touches);

}  // namespace cellcal::daemon
