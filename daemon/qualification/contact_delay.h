#pragma once
// How late the latched angles are behind the contact, from touches of one point at two speeds.
//
// A latch that is late by t reads a contact v t too deep. Every touch is searched for fast first
// and then slowly, along one line, so each says
//
//   t = (depth of the fast contact - mean depth of the slow ones) / (v_fast - v_slow)
//
// A constant delay makes all touches of one speed too deep alike, as a smaller effective radius
// would: by 10 um for each millisecond at 10 mm/s. The estimate tells the two apart as far as its
// touches do (calib/estimate, (74)). What is watched here is that it stays.

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

/// Below this difference of speeds the noise of a touch (0.03 mm) says more than the delay.
inline constexpr double kLeastSpeedDifferenceMS = 0.001;

struct ContactDelay {
  double delay_s = 0.0;  ///< positive: angles of an instant behind the contact
  double sigma_s = 0.0;  ///< 1 sigma of it
  int touches = 0;
};

/// The middle of the touches, with its uncertainty from their scatter; so one touch that slipped
/// changes nothing. Empty with fewer than five touches, or where the speeds hardly differ.
std::optional<ContactDelay> contact_delay(std::span<const FastAndSlow> touches, double fast_m_s,
                                          double slow_m_s);

/// "0.14 +- 0.02 ms (40 touches)".
std::string in_words(const ContactDelay& delay);

/// What is wrong with `now`, by itself and after `before` (an earlier session); empty: nothing.
std::string complaint(const ContactDelay& now, const std::optional<ContactDelay>& before);

// The contacts of each touch, out of a session's readings.

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
std::vector<FastAndSlow> fast_and_slow(std::span<const RecordReading> readings,
                                       std::size_t touches);

}  // namespace cellcal::daemon
