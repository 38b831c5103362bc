#pragma once
// Quality of the two links: phrases of what the daemon publishes, and judgements of the contact sensor and its path.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "daemon/doctor/examiner.h"
#include "daemon/service/status.h"
#include "drivers/contact.h"
#include "drivers/contact/port/adapter.h"

namespace cellcal::daemon {

// From "links" and "arm" of the status; empty for null and without packets. Keys missing in another version are omitted.

calib::Phrase robot_link_phrase(const nlohmann::json& robot);
calib::Phrase contact_link_phrase(const nlohmann::json& contact);
/// Motion and packet age.
calib::Phrase arm_phrase(const nlohmann::json& arm);
ArmMotion motion_of(const nlohmann::json& arm);

// Judges the path to the contact sensor: USB adapter or network interface.

void judge_adapter(const std::string& device, const std::optional<drivers::Adapter>& adapter,
                   int baud, Findings& findings);

/// For a board on Ethernet; reported under the same check.
void judge_interface(const std::optional<drivers::BoardInterface>& way, Findings& findings);

// Findings about the contact sensor from observed values. Pure: no port, no time.

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
