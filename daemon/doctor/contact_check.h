#pragma once
// What can be said of the contact sensor from what was seen of it. Pure: no port, no time.

#include <optional>
#include <string>

#include "daemon/doctor/finding.h"
#include "drivers/contact.h"

namespace cellcal::daemon {

struct ContactSeen {
  drivers::ContactStatus newest;
  std::uint16_t wanted_config_crc = 0;
  double observed_s = 0.0;
  int baud = 0;                   ///< of this side
  bool datagrams = false;         ///< a board on Ethernet
  bool touched = false;           ///< closed, and open again, at least once while it was looked at
  bool repeats = true;  ///< a touch in which this computer was late is repeated ([session] busy_repeats)
  std::optional<int> answers_at;  ///< the baud rate that the sensor was found at, if looked for
};

/// Who it is, its configuration, circuit, self-test and clock: once it is ready, or has had its
/// time. True: it can be relied on.
bool judge_contact(const ContactSeen& seen, Findings& findings);
/// The line, after it was observed for a while.
void judge_contact_line(const ContactSeen& seen, Findings& findings);
/// Whether a touch was seen. Both lugs off the gun and touching each other look like a free gun to
/// every other check.
void judge_contact_touch(const ContactSeen& seen, Findings& findings);
/// How late this computer delivered the sensor's bytes meanwhile.
void judge_contact_delivery(const ContactSeen& seen, Findings& findings);

}  // namespace cellcal::daemon
