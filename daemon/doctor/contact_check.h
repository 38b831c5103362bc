#pragma once
// Findings about the contact sensor from observed values. Pure: no port, no time.

#include <optional>
#include <string>

#include "daemon/doctor/examiner.h"
#include "drivers/contact.h"

namespace cellcal::daemon {

struct ContactSeen {
  drivers::ContactStatus newest;
  std::uint16_t wanted_config_crc = 0;
  double observed_s = 0.0;
  int baud = 0;            ///< of this side
  bool datagrams = false;  ///< a board on Ethernet
  bool touched = false;    ///< closed and reopened at least once during the observation
  /// Touches are repeated after lateness of this computer ([session] busy_repeats).
  bool repeats = true;
  std::optional<int> answers_at;  ///< baud rate at which the sensor answered, if searched for
};

/// Identity, configuration, circuit, self-test and clock, once the sensor is ready or has timed out. Returns
/// true if it is usable.
bool judge_contact(const ContactSeen& seen, Findings& findings);
/// Quality of the line, after an observation period.
void judge_contact_line(const ContactSeen& seen, Findings& findings);
/// Observation of a touch: with both lugs off the gun and touching each other, every other check sees a
/// free gun.
void judge_contact_touch(const ContactSeen& seen, Findings& findings);
/// Worst delivery delay of the sensor's bytes during the observation.
void judge_contact_delivery(const ContactSeen& seen, Findings& findings);

}  // namespace cellcal::daemon
